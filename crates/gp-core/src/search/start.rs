//! Where searches set out.

use std::fmt;

use kernels::TorqueCovariance;

/// Hyperparameters from which a search sets out.
#[derive(Debug, Clone, PartialEq)]
pub struct StartPoint {
    /// What makes this start different from the others.
    pub kind: StartKind,
    /// The covariance with its hyperparameters.
    pub covariance: TorqueCovariance,
    /// σ, in target units.
    pub noise_std: f64,
}

/// The starts that a fit may try.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StartKind {
    /// Eq. (22) as it stands.
    Chapter,
    /// Eq. (22) with length scales times √(3ℓ), so that typical pairs are
    /// one length scale apart in all covariates together.
    TypicalPairs,
    /// As [`StartKind::TypicalPairs`], with σ² = 10⁻⁴ t̄².
    TypicalPairsLowNoise,
    /// As [`StartKind::TypicalPairsLowNoise`], with length scales of velocities ten and of
    /// accelerations thirty times as long: by eq. (1) the torque is of second degree in the
    /// ones and of first in the others.
    SlowInRates,
    /// Given by the caller.
    Given,
}

impl fmt::Display for StartKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Chapter => "eq. (22)",
            Self::TypicalPairs => "length scales × √(3ℓ)",
            Self::TypicalPairsLowNoise => "length scales × √(3ℓ), low noise",
            Self::SlowInRates => "length scales × √(3ℓ)(1, 10, 30), low noise",
            Self::Given => "given",
        })
    }
}
