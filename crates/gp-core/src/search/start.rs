//! Where searches set out, with the names that model files and reports give it.

use std::fmt;

use kernels::TorqueCovariance;

/// Hyperparameters from which a search sets out.
#[derive(Debug, Clone, PartialEq)]
pub struct Start<C = TorqueCovariance> {
    /// The covariance with its hyperparameters.
    pub covariance: C,
    /// σ, in target units.
    pub noise_std: f64,
    /// Where they are from.
    pub origin: Origin,
    /// How near the optimum may be.
    pub distance: Distance,
}

impl<C> Start<C> {
    /// A start that is far from the optimum, as far as is known.
    pub fn new(origin: Origin, covariance: C, noise_std: f64) -> Self {
        Self {
            covariance,
            noise_std,
            origin,
            distance: Distance::Far,
        }
    }

    /// Hyperparameters of the caller's choice.
    pub fn given(covariance: C, noise_std: f64) -> Self {
        Self::new(Origin::Given, covariance, noise_std)
    }

    /// The same start at another distance from the optimum.
    #[must_use]
    pub fn at(self, distance: Distance) -> Self {
        Self { distance, ..self }
    }
}

/// How near an optimum is to a start, and so how its search begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Distance {
    /// Nothing is known: the search takes its steps in the logarithms of the hyperparameters.
    Far,
    /// Near, as at the end of a search on fewer data: the metric of the Fisher information suits
    /// from the first evaluation.
    ///
    /// Of more data rounding may leave too little of the likelihood there; σ is then raised until it
    /// is within half the limit.
    Near,
    /// The same at the end of a stage of a search, where σ is also raised until more samples are no surprise.
    MoreSamples,
}

/// Where the hyperparameters of a start are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// Eq. (22) as it stands.
    Chapter,
    /// Eq. (22) with length scales times √(3ℓ), so that typical pairs are
    /// one length scale apart in all covariates together.
    TypicalPairs,
    /// As [`Origin::TypicalPairs`], with σ² = 10⁻⁴ t̄².
    TypicalPairsLowNoise,
    /// As [`Origin::TypicalPairsLowNoise`], with length scales of velocities ten and of
    /// accelerations thirty times as long: by eq. (1) the torque is of second degree in the
    /// ones and of first in the others.
    SlowInRates,
    /// A.3, from the model that takes several tasks for one (K₀^ρ = 11ᵀ) and eq. (28).
    Pooled,
    /// A.3, from the model of independent tasks (K₀^ρ = I) and eq. (28).
    Independent,
    /// A fit of a lower rank to the same data, with new columns of Λ.
    LowerRank,
    /// What is known of several tasks beforehand: K^ρ of their descriptors.
    Described,
    /// Given by the caller, such as a fit to fewer data.
    Given,
}

impl Origin {
    /// Names in model files and messages, and in the columns of CSV files.
    fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Chapter => ("eq. (22)", "eq22"),
            Self::TypicalPairs => ("length scales × √(3ℓ)", "lengths-x-sqrt-3l"),
            Self::TypicalPairsLowNoise => (
                "length scales × √(3ℓ), low noise",
                "lengths-x-sqrt-3l-low-noise",
            ),
            Self::SlowInRates => (
                "length scales × √(3ℓ)(1, 10, 30), low noise",
                "slow-in-rates",
            ),
            Self::Pooled => ("A.3 from pGP", "pGP"),
            Self::Independent => ("A.3 from iGP", "iGP"),
            Self::LowerRank => ("lower rank", "lower-rank"),
            Self::Described => ("descriptors", "descriptors"),
            Self::Given => ("given", "given"),
        }
    }

    /// Name in a column of a CSV file: no spaces.
    pub fn key(self) -> &'static str {
        self.names().1
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.names().0)
    }
}
