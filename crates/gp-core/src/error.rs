//! What can go wrong in Gaussian-process regression, with the numbers of the case.

/// Why a factorisation, likelihood, prediction or fit has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpError {
    /// The covariance matrix has no Cholesky factor in double precision.
    #[error("covariance matrix of order {order} is not positive definite at pivot {pivot}")]
    NotPositiveDefinite {
        /// Index of the first pivot that is not a positive number.
        pivot: usize,
        /// Order of the matrix.
        order: usize,
    },
    /// The log marginal likelihood or its gradient overflowed.
    #[error("log marginal likelihood of {n_samples} samples is not a finite number")]
    NonFiniteLikelihood {
        /// Number of samples.
        n_samples: usize,
    },
    /// Too many samples for the dense path, and too high a rank for the other.
    #[error(
        "{n_samples} samples need a covariance of rank above {largest}, which is beyond this method: \
         use fewer samples, or expect more noise"
    )]
    RankTooHigh {
        /// Number of samples.
        n_samples: usize,
        /// Largest rank that the low-rank path takes on.
        largest: usize,
    },
    /// An input is NaN or infinite.
    #[error("input at row {row}, column {column} is {value}, not a finite number")]
    NonFiniteInput {
        /// Row (sample), from zero.
        row: usize,
        /// Column (covariate), from zero.
        column: usize,
        /// The value found.
        value: f64,
    },
    /// A target is NaN or infinite.
    #[error("target at row {row} is {value}, not a finite number")]
    NonFiniteTarget {
        /// Row (sample), from zero.
        row: usize,
        /// The value found.
        value: f64,
    },
    /// There is too little data to learn from.
    #[error("{n_samples} samples given, at least {needed} needed")]
    TooFewSamples {
        /// Samples given.
        n_samples: usize,
        /// Samples needed.
        needed: usize,
    },
    /// There is not one target per row of inputs.
    #[error("{n_inputs} rows of inputs but {n_targets} targets")]
    CountMismatch {
        /// Rows of inputs.
        n_inputs: usize,
        /// Targets.
        n_targets: usize,
    },
    /// Inputs have another number of covariates than the model.
    #[error("inputs have {found} columns, expected {expected}")]
    WrongCovariates {
        /// Columns given.
        found: usize,
        /// Columns needed.
        expected: usize,
    },
    /// The columns of the inputs are not (q, q̇, q̈) of some number of joints.
    #[error("inputs have {columns} columns, which is not three per joint")]
    NotThreePerJoint {
        /// Columns given.
        columns: usize,
    },
    /// The noise standard deviation is not a finite number above zero.
    #[error("noise_std is {value}, but must be finite and greater than zero")]
    BadNoise {
        /// The value given.
        value: f64,
    },
    /// Rounding alone could move the likelihood by more than a search can live with.
    #[error(
        "rounding could move the log marginal likelihood of {n_samples} samples by {nats:.1e} nats, \
         more than {largest}: noise_std is too small beside the covariance"
    )]
    TooMuchRounding {
        /// Number of samples.
        n_samples: usize,
        /// Bound on what rounding moves, in nats.
        nats: f64,
        /// Largest such bound that a search enters.
        largest: f64,
    },
    /// No start of the search has a likelihood.
    #[error("none of the {n_starts} starts has a finite log marginal likelihood{}", .reason.as_ref().map(|reason| format!(": {reason}")).unwrap_or_default())]
    NoUsableStart {
        /// Starts tried.
        n_starts: usize,
        /// Why the first of them has none, if all of them failed for the same reason.
        reason: Option<Box<GpError>>,
    },
    /// A chain of draws that cannot begin or go on.
    #[error("the sampler gave up: {reason}")]
    Sampler {
        /// In the sampler's words.
        reason: String,
    },
    /// The hyperparameters of a start are unusable.
    #[error(transparent)]
    Kernel(#[from] kernels::KernelError),
    /// A matrix without the factor or spectrum that an answer needs.
    #[error(transparent)]
    Linalg(linalg::LinalgError),
}

impl From<linalg::LinalgError> for GpError {
    fn from(error: linalg::LinalgError) -> Self {
        match error {
            linalg::LinalgError::NotPositiveDefinite { pivot, order } => {
                Self::NotPositiveDefinite { pivot, order }
            }
            other => Self::Linalg(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::mat;
    use linalg::Factor;

    use super::*;

    #[test]
    fn a_matrix_without_a_factor_is_a_covariance_that_is_not_positive_definite() {
        let indefinite = mat![[1.0, 0.0], [2.0, 1.0]];
        let error = GpError::from(Factor::new(indefinite).unwrap_err());
        assert_eq!(error, GpError::NotPositiveDefinite { pivot: 1, order: 2 });
    }
}
