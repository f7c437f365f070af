//! What a fit says of itself: its starts, their likelihoods, and the help it needed.

use super::start::Origin;
use crate::evidence::MethodUsed;
use crate::optimize::StopReason;

/// What one start led to.
#[derive(Debug, Clone, PartialEq)]
pub struct StartReport {
    /// Which start.
    pub origin: Origin,
    /// Log marginal likelihood at the start; `None` if it has none.
    pub initial_log_marginal: Option<f64>,
    /// Log marginal likelihood at the end; −∞ if the start has none.
    pub log_marginal: f64,
    /// L-BFGS iterations.
    pub iterations: usize,
    /// Likelihoods with gradient.
    pub evaluations: usize,
    /// Their work, in likelihoods by the dense path on the same samples.
    pub work: f64,
    /// Restarts from steepest descent after a failed line search or a stall.
    pub recoveries: usize,
    /// Largest component of the projected gradient at the end.
    pub projected_gradient: f64,
    /// Why the search ended.
    pub stop: StopReason,
}

/// What the searches on one set of samples led to.
#[derive(Debug, Clone, PartialEq)]
pub struct StageReport {
    /// Samples that these searches saw.
    pub n_samples: usize,
    /// Every start, in the order tried: in later stages from where the best of the stage before ended.
    pub starts: Vec<StartReport>,
}

impl StageReport {
    /// Index of the start that ended highest, the earliest of equals; `None` if none has a likelihood.
    pub fn winner(&self) -> Option<usize> {
        highest(self.starts.iter().map(|start| start.log_marginal))
    }
}

/// Index of the highest finite value; the earliest of equals.
pub(super) fn highest(values: impl Iterator<Item = f64>) -> Option<usize> {
    let finite = values.enumerate().filter(|(_, value)| value.is_finite());
    let best = finite.reduce(|best, next| if next.1 > best.1 { next } else { best });
    best.map(|(idx, _)| idx)
}

/// How a fit was found and what help it needed.
#[derive(Debug, Clone, PartialEq)]
pub struct FitReport {
    /// Log marginal likelihood of the fit, natural log, summed over the data.
    pub log_marginal: f64,
    /// The searches on more and more samples; the last on all of them.
    pub stages: Vec<StageReport>,
    /// Index in the last stage of the start that won.
    pub winner: usize,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// What was added to the diagonal beyond σ²: always 0 here, as nothing ever is.
    pub jitter_added: f64,
    /// How the matrix of the fit was factorised.
    pub method: MethodUsed,
    /// Rank of that factor: the number of samples if dense.
    pub rank: usize,
    /// Bound on the error of the log marginal likelihood at the hyperparameters found, in nats.
    pub error_bound: f64,
    /// A lower bound on the condition number of K + σ²I.
    pub condition_lower_bound: f64,
    /// Wall-clock seconds; the library has no clock, so only a caller fills it.
    pub seconds: Option<f64>,
}

impl FitReport {
    /// The searches on all samples.
    ///
    /// # Panics
    /// If `stages` is empty, which that of a fit never is.
    pub fn last_stage(&self) -> &StageReport {
        self.stages.last().expect("a fit has a stage")
    }

    /// The start that won.
    ///
    /// # Panics
    /// If `stages` or its last entry has no entry, which is never so for a fit.
    pub fn winning_start(&self) -> &StartReport {
        &self.last_stage().starts[self.winner]
    }

    /// Where the start that won is from.
    ///
    /// # Panics
    /// As for [`FitReport::winning_start`].
    pub fn origin(&self) -> Origin {
        self.winning_start().origin
    }

    /// Evaluations of all starts on all sets of samples together.
    pub fn evaluations(&self) -> usize {
        self.all_starts().map(|start| start.evaluations).sum()
    }

    /// Recoveries of all starts on all sets of samples together.
    pub fn recoveries(&self) -> usize {
        self.all_starts().map(|start| start.recoveries).sum()
    }

    fn all_starts(&self) -> impl Iterator<Item = &StartReport> {
        self.stages.iter().flat_map(|stage| &stage.starts)
    }
}
