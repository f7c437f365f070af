//! What can be wrong with the hyperparameters given to a covariance.

/// Why a covariance cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum KernelError {
    /// A standard deviation or length scale is not a finite number above zero.
    #[error("{name} is {value}, but must be finite and greater than zero")]
    NotPositive {
        /// Name of the hyperparameter, with its component: `length_scales[4]`.
        name: String,
        /// The value given.
        value: f64,
    },
    /// An entry of a given matrix is NaN or infinite.
    #[error("{name} is {value}, not a finite number")]
    NotFinite {
        /// Name of the matrix, with the entry: `parameter_root[3,3]`.
        name: String,
        /// The value given.
        value: f64,
    },
    /// A vector of hyperparameters does not have one entry per covariate or joint.
    #[error("{name} has {found} entries, expected {expected}")]
    WrongCount {
        /// Name of the hyperparameter vector.
        name: &'static str,
        /// Entries given.
        found: usize,
        /// Entries needed.
        expected: usize,
    },
}
