//! Where the searches of one stage set out, from where those of the stage before ended.

use kernels::TorqueCovariance;

use crate::init::{StartKind, StartPoint};
use crate::search::{SearchEnd, inside_bounds};

/// A point from which a stage sets out.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub kind: StartKind,
    pub covariance: TorqueCovariance,
    pub noise_std: f64,
    /// Whether it comes from a stage with fewer samples.
    pub is_heir: bool,
}

impl Candidate {
    /// A start of the first stage.
    pub fn of(start: &StartPoint) -> Self {
        Self {
            kind: start.kind,
            covariance: start.covariance.clone(),
            noise_std: start.noise_std,
            is_heir: false,
        }
    }

    /// The end of a search on fewer samples.
    pub fn heir(end: &SearchEnd<TorqueCovariance>) -> Self {
        Self {
            kind: end.report.kind,
            covariance: end.covariance.clone(),
            noise_std: end.noise_std,
            is_heir: true,
        }
    }

    /// Moves hyperparameters that sit on a bound a little inside it.
    pub fn keep_inside(&mut self) {
        self.noise_std = inside_bounds(&mut self.covariance, self.noise_std);
    }
}
