//! A multi-task fit's report in the form that records keep.

use kernels::Covariance;
use mtgp::{Origin, TaskFit, TaskStart};

use crate::fit_summary::{FitSummary, StartSummary, method_name, start_name, stop_name};

/// Summary of a fit; its hyperparameters are those of c^x, Λ has a place of its own.
///
/// `n_samples` is what its searches saw.
pub fn summary_of(fit: &TaskFit, n_samples: usize) -> FitSummary {
    let report = &fit.report;
    let winner = report.winning_start();
    FitSummary {
        log_marginal_likelihood: report.log_marginal,
        start: origin_name(winner.origin).to_string(),
        stop: stop_name(winner.report.stop).to_string(),
        iterations: winner.report.iterations,
        evaluations: report.evaluations(),
        recoveries: report.starts.iter().map(|s| s.report.recoveries).sum(),
        noise_std: fit.noise_std(),
        hyperparameters: fit.covariance().input().params(),
        bounds_hit: report.bounds_hit.clone(),
        method: method_name(report.method).to_string(),
        rank: report.factor_rank,
        error_bound: report.error_bound,
        starts: (report.starts.iter())
            .map(|start| start_summary(start, n_samples))
            .collect(),
    }
}

fn start_summary(start: &TaskStart, n_samples: usize) -> StartSummary {
    StartSummary {
        samples: n_samples,
        name: origin_name(start.origin).to_string(),
        log_marginal_likelihood: start.report.log_marginal,
        evaluations: start.report.evaluations,
        work: start.report.work,
        projected_gradient: start.report.projected_gradient,
        stop: stop_name(start.report.stop).to_string(),
    }
}

/// Name of a start in records and reports.
fn origin_name(origin: Origin) -> &'static str {
    match origin {
        Origin::Moments(kind) => start_name(kind),
        Origin::Pooled => "pGP",
        Origin::Independent => "iGP",
        Origin::LowerRank => "lower-rank",
        Origin::Given => "given",
        _ => "other",
    }
}
