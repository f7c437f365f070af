//! What can be wrong with a matrix, with the numbers of the case.

/// Why a matrix has no factor or no spectrum.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LinalgError {
    /// A matrix has no Cholesky factor in double precision.
    #[error("matrix of order {order} is not positive definite at pivot {pivot}")]
    NotPositiveDefinite {
        /// Index of the first pivot that is not a positive number.
        pivot: usize,
        /// Order of the matrix.
        order: usize,
    },
    /// A matrix has no eigen- or singular value decomposition, which an entry that is not finite causes.
    #[error("matrix of {rows} rows and {columns} columns has no spectral decomposition")]
    NoSpectrum {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
}
