//! What a fit reported, in the form that records keep, with the names that stand in it.

use gp_core::MethodUsed;
use gp_core::optimize::StopReason;
use gp_core::search::StageReport;
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

/// The searches of a stage.
pub(crate) fn stage_summary(stage: &StageReport) -> impl Iterator<Item = StartSummary> {
    stage.starts.iter().map(|start| StartSummary {
        samples: stage.n_samples,
        name: start.origin.key().to_string(),
        log_marginal_likelihood: start.log_marginal,
        evaluations: start.evaluations,
        work: start.work,
        projected_gradient: start.projected_gradient,
        stop: stop_name(start.stop).to_string(),
    })
}

/// Name of the way the likelihood was computed.
pub(crate) fn method_name(method: MethodUsed) -> &'static str {
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
