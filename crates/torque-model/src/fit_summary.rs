//! What a model keeps of the fit of its hyperparameters.

use gp_core::search::{FitReport, StageReport};
use serde::{Deserialize, Serialize};

/// How the hyperparameters of a process were found.
///
/// Its fields stand in model files in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FitSummary {
    /// Log marginal likelihood, natural log, summed over the data.
    pub log_marginal: f64,
    /// The start that won.
    pub start: String,
    /// Starts tried.
    pub n_starts: usize,
    /// Likelihoods with gradient, of all starts together.
    pub evaluations: usize,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// A lower bound on the condition number of K + σ²I.
    pub condition_lower_bound: f64,
    /// How K was factorised: `dense` or `certified`, the low-rank path.
    pub method: String,
    /// Rank of the factorisation; n for a dense one.
    pub rank: usize,
    /// Bound on the error of the log marginal likelihood, in nats; `None` if not known.
    pub error_bound: Option<f64>,
}

impl FitSummary {
    /// Of a fit, with the start that won by its name.
    pub fn of(report: &FitReport) -> Self {
        Self {
            log_marginal: report.log_marginal,
            start: report.origin().to_string(),
            n_starts: report.stages.first().map_or(0, |stage| stage.starts.len()),
            evaluations: report.evaluations(),
            bounds_hit: report.bounds_hit.clone(),
            condition_lower_bound: report.condition_lower_bound,
            method: report.method.to_string(),
            rank: report.rank,
            error_bound: Some(report.error_bound),
        }
    }

    /// Of a fit whose starts were all given: the one that won by its number, from 1.
    pub fn of_given(report: &FitReport) -> Self {
        let first = report.stages.first().and_then(StageReport::winner);
        Self {
            start: (first.unwrap_or_default() + 1).to_string(),
            ..Self::of(report)
        }
    }
}
