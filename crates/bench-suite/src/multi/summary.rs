//! A multi-task fit's report in the form that records keep.

use kernels::Covariance;
use mtgp::TaskFit;

use crate::fit_summary::{FitSummary, method_name, stage_summary, stop_name};

/// Summary of a fit; its hyperparameters are those of c^x, Λ has a place of its own.
pub fn summary_of(fit: &TaskFit) -> FitSummary {
    let report = &fit.report;
    let winner = report.winning_start();
    FitSummary {
        log_marginal_likelihood: report.log_marginal,
        start: winner.origin.key().to_string(),
        stop: stop_name(winner.stop).to_string(),
        iterations: winner.iterations,
        evaluations: report.evaluations(),
        recoveries: report.recoveries(),
        noise_std: fit.noise_std(),
        hyperparameters: fit.covariance().input().params(),
        bounds_hit: report.bounds_hit.clone(),
        method: method_name(report.method).to_string(),
        rank: report.rank,
        error_bound: report.error_bound,
        starts: report.stages.iter().flat_map(stage_summary).collect(),
    }
}
