//! From where, on which samples, how long and how hard to search.

use kernels::ContinuousJoints;

use super::start::Origin;
use crate::evidence::LikelihoodOptions;

/// From where the search sets out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Starts {
    /// Eq. (22) alone.
    Chapter,
    // DEVIATION(A.1): the chapter has one start, from which the squared exponential is
    // often switched off before it is tried.
    /// Eq. (22) and variations of it; the highest likelihood is kept.
    Several,
}

impl Starts {
    /// The variations of eq. (22) that it stands for, in the order tried.
    pub fn origins(self) -> &'static [Origin] {
        match self {
            Self::Chapter => &[Origin::Chapter],
            Self::Several => &[
                Origin::Chapter,
                Origin::TypicalPairs,
                Origin::TypicalPairsLowNoise,
                Origin::SlowInRates,
            ],
        }
    }
}

/// Which samples the searches see.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchScheme {
    /// All samples, from every start, until it converges.
    Whole,
    // DEVIATION(sec. 3): the chapter searches on all samples from one start.
    /// Beyond 512 samples at first an eighth, say, of them, then twice as many, up to
    /// all: every start on the smallest subset, the best ends of each stage on the
    /// next, and no stage takes more work than its limit.
    Nested,
}

/// How long and how hard to search.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// The starts.
    pub starts: Starts,
    /// Which samples the searches see.
    pub scheme: SearchScheme,
    /// Likelihoods with gradient that each search may use: half of them to come near, and
    /// the highest end of all starts the rest.
    pub max_evaluations: usize,
    /// Work that each search may take, in likelihoods by the dense path.
    pub max_work: f64,
    /// Converged when no component of the projected gradient with respect to the
    /// logarithms of the hyperparameters is larger, in nats.
    pub gradient_tolerance: f64,
    /// Stalled when an iteration gains less than this, in nats.
    pub value_tolerance: f64,
    /// How each likelihood is computed.
    pub likelihood: LikelihoodOptions,
    /// Joints of whose positions a covariance of torques sees the place on the circle.
    pub continuous: ContinuousJoints,
}

impl FitOptions {
    /// Eq. (22) alone on all samples, with up to 300 evaluations.
    pub fn chapter() -> Self {
        Self {
            starts: Starts::Chapter,
            scheme: SearchScheme::Whole,
            max_evaluations: 300,
            max_work: f64::INFINITY,
            gradient_tolerance: 1e-3,
            value_tolerance: 1e-5,
            likelihood: LikelihoodOptions::automatic(),
            continuous: ContinuousJoints::none(),
        }
    }

    /// Several starts, nested, with up to 600 evaluations for each search.
    pub fn several() -> Self {
        Self {
            starts: Starts::Several,
            scheme: SearchScheme::Nested,
            max_evaluations: 600,
            ..Self::chapter()
        }
    }

    /// What each search may take.
    pub fn limits(&self) -> Limits {
        Limits {
            max_evaluations: self.max_evaluations,
            max_work: self.max_work,
            gradient_tolerance: self.gradient_tolerance,
            value_tolerance: self.value_tolerance,
        }
    }
}

/// What one search may take, and when it is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Likelihoods with gradient.
    pub max_evaluations: usize,
    /// Work, in likelihoods by the dense path.
    pub max_work: f64,
    /// Converged when no component of the projected gradient is larger, in nats.
    pub gradient_tolerance: f64,
    /// Stalled when an iteration gains less, in nats.
    pub value_tolerance: f64,
}

impl Limits {
    /// The same limits with other evaluations.
    #[must_use]
    pub fn with_evaluations(self, max_evaluations: usize) -> Self {
        Self {
            max_evaluations,
            ..self
        }
    }

    /// The same limits with other work.
    #[must_use]
    pub fn with_work(self, max_work: f64) -> Self {
        Self { max_work, ..self }
    }
}
