//! Spectral decompositions on one thread, whose failure is this crate's error.
//!
//! Source: Golub & Van Loan 2013, secs. 8.3 and 8.6.

use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Mat, MatRef, Par, Spec};
use gp_core::sequential;
pub(crate) use gp_core::sequential::{SymmetricEigen, product};

use crate::error::MtgpError;

/// A matrix as U diag(s) Vᵀ, singular values in decreasing order, p = min(rows, columns) of them.
#[derive(Debug, Clone)]
pub(crate) struct ThinSvd {
    /// U, (rows, p).
    pub left: Mat<f64>,
    /// s, (p,).
    pub values: Vec<f64>,
    /// V, (columns, p).
    pub right: Mat<f64>,
}

/// Eigenvalues and eigenvectors of a symmetric matrix, read from its lower triangle.
///
/// # Errors
/// [`MtgpError::NoSpectrum`] if an entry is not finite or the iteration does not converge.
pub(crate) fn symmetric_eigen(matrix: MatRef<'_, f64>) -> Result<SymmetricEigen, MtgpError> {
    sequential::symmetric_eigen(matrix).ok_or(MtgpError::NoSpectrum {
        rows: matrix.nrows(),
        columns: matrix.ncols(),
    })
}

/// Singular values and vectors.
///
/// # Errors
/// [`MtgpError::NoSpectrum`] if an entry is not finite or the iteration does not converge.
pub(crate) fn thin_svd(matrix: MatRef<'_, f64>) -> Result<ThinSvd, MtgpError> {
    let (rows, columns) = (matrix.nrows(), matrix.ncols());
    let failed = MtgpError::NoSpectrum { rows, columns };
    if !matrix.is_all_finite() {
        return Err(failed);
    }
    let p = rows.min(columns);
    let mut values = vec![0.0; p];
    let (mut left, mut right) = (Mat::zeros(rows, p), Mat::zeros(columns, p));
    let thin = ComputeSvdVectors::Thin;
    let scratch = svd_scratch::<f64>(rows, columns, thin, thin, Par::Seq, Spec::default());
    svd(
        matrix,
        DiagMut::from_slice_mut(&mut values),
        Some(left.as_mut()),
        Some(right.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .map_err(|_| failed)?;
    Ok(ThinSvd {
        left,
        values,
        right,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    #[test]
    fn singular_values_of_a_row_are_its_length() {
        let svd = thin_svd(mat![[3.0, 4.0]].as_ref()).unwrap();
        assert!((svd.values[0] - 5.0).abs() <= 8.0 * f64::EPSILON * 5.0);
        let back = svd.left[(0, 0)] * svd.values[0] * svd.right[(1, 0)];
        assert!((back - 4.0).abs() <= 8.0 * f64::EPSILON * 4.0);
    }

    #[test]
    fn a_matrix_with_nan_has_no_spectrum() {
        let spoilt = mat![[1.0, 0.0], [f64::NAN, 1.0]];
        assert!(matches!(
            symmetric_eigen(spoilt.as_ref()),
            Err(MtgpError::NoSpectrum { rows: 2, .. })
        ));
        assert!(thin_svd(spoilt.as_ref()).is_err());
    }
}
