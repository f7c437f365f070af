//! What a fit reported, in the form that records keep, with the names that stand in it.

use gp_core::MethodUsed;
use gp_core::optimize::StopReason;
use gp_core::search::{FitReport, StageReport, StartReport};
use serde::{Deserialize, Serialize};

/// What a Gaussian-process fit reported.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitSummary {
    /// Natural log of eq. (8) at the end, summed over the data.
    pub log_marginal_likelihood: f64,
    /// Start that reached it.
    pub start: String,
    /// Why the search from that start ended.
    pub stop: String,
    /// Iterations of the optimiser from that start.
    pub iterations: usize,
    /// Evaluations of eq. (8) over all starts.
    pub evaluations: usize,
    /// Restarts after a failed line search, over all starts.
    pub recoveries: usize,
    /// σ, N·m.
    pub noise_std: f64,
    /// θ without σ, natural values in the order of the covariance's layout.
    pub hyperparameters: Vec<f64>,
    /// Hyperparameters that ended on a bound.
    pub bounds_hit: Vec<String>,
    /// How the matrix of the fit was factorised: dense or certified.
    pub method: String,
    /// Rank of that factor.
    pub rank: usize,
    /// Bound on the error of the log marginal likelihood, in nats.
    pub error_bound: f64,
    /// Every search, in the order made: on the smallest subset of the samples first.
    pub starts: Vec<StartSummary>,
}

/// Where one search ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StartSummary {
    /// Samples that it saw.
    pub samples: usize,
    /// Name of the start that it goes back to.
    pub name: String,
    /// Eq. (8) at its end; −∞ if it is undefined at the start.
    pub log_marginal_likelihood: f64,
    /// Evaluations of eq. (8).
    pub evaluations: usize,
    /// Their work, in evaluations by the dense path on the same samples.
    pub work: f64,
    /// Largest component of the projected gradient at the end.
    pub projected_gradient: f64,
    /// Why it ended.
    pub stop: String,
}

impl FitSummary {
    /// Of a report, with σ and the other hyperparameters found.
    pub(crate) fn of(report: &FitReport, noise_std: f64, hyperparameters: Vec<f64>) -> Self {
        let winner = report.winning_start();
        Self {
            log_marginal_likelihood: report.log_marginal,
            start: winner.origin.key().to_string(),
            stop: stop_name(winner.stop).to_string(),
            iterations: winner.iterations,
            evaluations: report.evaluations(),
            recoveries: report.recoveries(),
            noise_std,
            hyperparameters,
            bounds_hit: report.bounds_hit.clone(),
            method: method_name(report.method).to_string(),
            rank: report.rank,
            error_bound: report.error_bound,
            starts: report.stages.iter().flat_map(stage_summary).collect(),
        }
    }
}

impl StartSummary {
    /// Of a search on some samples.
    pub(crate) fn of(start: &StartReport, samples: usize) -> Self {
        Self {
            samples,
            name: start.origin.key().to_string(),
            log_marginal_likelihood: start.log_marginal,
            evaluations: start.evaluations,
            work: start.work,
            projected_gradient: start.projected_gradient,
            stop: stop_name(start.stop).to_string(),
        }
    }
}

fn stage_summary(stage: &StageReport) -> impl Iterator<Item = StartSummary> {
    let starts = stage.starts.iter();
    starts.map(|start| StartSummary::of(start, stage.n_samples))
}

/// Name of the way the likelihood was computed.
fn method_name(method: MethodUsed) -> &'static str {
    match method {
        MethodUsed::Dense => "dense",
        MethodUsed::Certified => "certified",
    }
}

/// Name of the reason why a search ended.
pub(crate) fn stop_name(stop: StopReason) -> &'static str {
    match stop {
        StopReason::GradientSmall => "gradient-small",
        StopReason::ValueStalled => "value-stalled",
        StopReason::EvaluationLimit => "evaluation-limit",
        StopReason::WorkLimit => "work-limit",
        StopReason::RecoveryLimit => "recovery-limit",
        StopReason::StartUndefined => "start-undefined",
        _ => "other",
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Made-up numbers of a fit to 170 samples, which one search led to.
    pub(crate) fn summary() -> FitSummary {
        FitSummary {
            log_marginal_likelihood: -705.25,
            start: "eq22".into(),
            stop: "gradient-small".into(),
            iterations: 7,
            evaluations: 11,
            recoveries: 0,
            noise_std: 0.01,
            hyperparameters: vec![1.0, 1.0 / 3.0],
            bounds_hit: Vec::new(),
            method: "dense".into(),
            rank: 40,
            error_bound: 1e-9,
            starts: vec![start()],
        }
    }

    /// Its search.
    pub(crate) fn start() -> StartSummary {
        StartSummary {
            samples: 170,
            name: "eq22".into(),
            log_marginal_likelihood: -705.25,
            evaluations: 10,
            work: 10.0,
            projected_gradient: 0.5,
            stop: "gradient-small".into(),
        }
    }
}
