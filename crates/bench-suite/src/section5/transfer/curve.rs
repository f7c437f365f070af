//! One learning curve of one target and joint: the unit of work, and the record of its result.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::spec::MAX_SIZE;
use crate::split::UNIQUE;
use crate::store::{Finished, Work};

/// Fingerprint of sources, data and dependencies behind a curve, made by the build script.
const MEASURED_BY: &str = env!("TRANSFER_MEASURED_BY");

/// Other loads beside the target where their number is not what varies.
pub const N_OTHERS: usize = 13;

/// What grows along a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// The number of other loads in the model.
    Others,
    /// The number of the target's samples.
    Samples,
}

impl Axis {
    /// Both, in the order of the picture's rows.
    pub const ALL: [Self; 2] = [Self::Others, Self::Samples];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Others => "others",
            Self::Samples => "samples",
        }
    }

    /// Name in tables and pictures.
    pub fn label(self) -> &'static str {
        match self {
            Self::Others => "other loads",
            Self::Samples => "samples of the target",
        }
    }
}

/// A way to learn the target load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Learner {
    /// GPc of the target's samples alone.
    #[serde(rename = "sGP")]
    Single,
    /// K^ρ = I.
    #[serde(rename = "iGP")]
    Independent,
    /// K^ρ = 11ᵀ.
    #[serde(rename = "pGP")]
    Pooled,
    /// K^ρ = ΛΛᵀ.
    #[serde(rename = "mGP")]
    Transfer,
}

impl Learner {
    /// All, in the order of the chapter's legend.
    pub const ALL: [Self; 4] = [
        Self::Single,
        Self::Independent,
        Self::Pooled,
        Self::Transfer,
    ];

    /// Name in tables and pictures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "sGP",
            Self::Independent => "iGP",
            Self::Pooled => "pGP",
            Self::Transfer => "mGP",
        }
    }
}

/// A curve of one target and joint, all learners and places on its axis.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Curve {
    /// What grows.
    pub axis: Axis,
    /// Load c`target` that is scored.
    pub target: usize,
    /// Joint, from 1.
    pub joint: usize,
    /// Places on the axis, ascending.
    pub counts: Vec<usize>,
    /// Samples of each load whose number of samples does not vary.
    pub n_each: usize,
    /// Every `test_stride`-th row of the target's extrap set is predicted.
    pub test_stride: usize,
}

impl Curve {
    /// Other loads and the target's samples at a place.
    pub fn sizes(&self, count: usize) -> (usize, usize) {
        match self.axis {
            Axis::Others => (count, self.n_each),
            Axis::Samples => (N_OTHERS, count),
        }
    }

    /// Checks target, joint, places and stride.
    ///
    /// # Errors
    /// `Experiment` with the one that cannot be measured.
    pub fn require_possible(&self) -> Result<(), BenchError> {
        let refuse = |message: String| Err(BenchError::experiment("transfer", message));
        let is_measurable = |&count: &usize| {
            let (n_others, n_target) = self.sizes(count);
            n_others < UNIQUE.len() && (2..=MAX_SIZE).contains(&n_target)
        };
        if !(1..=UNIQUE.len()).contains(&self.target) {
            return refuse(format!("there is no load c{}", self.target));
        }
        if !(1..=N_JOINTS).contains(&self.joint) {
            return refuse(format!("there is no joint {}", self.joint));
        }
        if self.n_each == 0 || self.test_stride == 0 {
            return refuse("samples of each load and stride are at least 1".to_string());
        }
        match self.counts.iter().find(|count| !is_measurable(count)) {
            Some(count) => refuse(format!(
                "{count} {} is not possible: at most 14 other loads, and 2 to {} samples of the target",
                self.axis.label(),
                MAX_SIZE
            )),
            None => Ok(()),
        }
    }
}

impl fmt::Display for Curve {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (axis, target, joint) = (self.axis.label(), self.target, self.joint);
        write!(f, "{axis}, c{target}, joint {joint}")
    }
}

impl Work for Curve {
    type Record = CurveRecord;

    fn key(&self) -> String {
        format!(
            "format 1; measured by {MEASURED_BY}; axis {}; target c{}; joint {}; counts {:?}; each {}; stride {}",
            self.axis.name(),
            self.target,
            self.joint,
            self.counts,
            self.n_each,
            self.test_stride
        )
    }

    fn cost(&self) -> impl Ord {
        (self.axis, self.counts.last().copied())
    }
}

/// nMSE of one learner at one place.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// The learner.
    pub learner: Learner,
    /// Place on the axis.
    pub count: usize,
    /// On the target's extrap set.
    pub nmse: f64,
    /// Natural log of eq. (8), summed over the data of the model.
    pub log_marginal_likelihood: f64,
    /// Evaluations of eq. (8) by its searches.
    pub evaluations: usize,
}

/// Result of a curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CurveRecord {
    /// The curve.
    pub curve: Curve,
    /// Scores, by place and learner.
    pub scores: Vec<Score>,
}

impl CurveRecord {
    /// The score of a learner at a place.
    pub fn nmse(&self, learner: Learner, count: usize) -> Option<f64> {
        let mut scores = self.scores.iter();
        let score = scores.find(|score| (score.learner, score.count) == (learner, count))?;
        Some(score.nmse)
    }
}

impl Finished for CurveRecord {
    type Work = Curve;

    fn work(&self) -> &Curve {
        &self.curve
    }
}
