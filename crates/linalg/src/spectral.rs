//! Matrix products, eigenvalues and singular values on one thread.
//!
//! faer's operators and solver objects follow a global setting for threads; results here must not
//! depend on it.
//!
//! Source: Golub & Van Loan 2013, secs. 8.3 and 8.6.

use faer::diag::DiagMut;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Mat, MatRef, Par, Spec};

use crate::error::LinalgError;

/// A symmetric matrix as U diag(s) Uᵀ, eigenvalues in increasing order.
#[derive(Debug, Clone)]
pub struct SymmetricEigen {
    /// s, (n,).
    pub values: Vec<f64>,
    /// U, (n, n), one eigenvector per column.
    pub vectors: Mat<f64>,
}

/// A matrix as U diag(s) Vᵀ, singular values in decreasing order, p = min(rows, columns) of them.
#[derive(Debug, Clone)]
pub struct ThinSvd {
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
/// [`LinalgError::NoSpectrum`] if an entry is not finite or the iteration does not converge.
/// # Panics
/// If the matrix is not square.
pub fn symmetric_eigen(matrix: MatRef<'_, f64>) -> Result<SymmetricEigen, LinalgError> {
    let order = matrix.nrows();
    let failed = LinalgError::NoSpectrum {
        rows: order,
        columns: matrix.ncols(),
    };
    if !is_finite_lower(matrix) {
        return Err(failed);
    }
    let mut values = vec![0.0; order];
    let mut vectors = Mat::zeros(order, order);
    let vectors_too = ComputeEigenvectors::Yes;
    let scratch = self_adjoint_evd_scratch::<f64>(order, vectors_too, Par::Seq, Spec::default());
    self_adjoint_evd(
        matrix,
        DiagMut::from_slice_mut(&mut values),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Spec::default(),
    )
    .map_err(|_| failed)?;
    Ok(SymmetricEigen { values, vectors })
}

/// Singular values and vectors.
///
/// # Errors
/// [`LinalgError::NoSpectrum`] if an entry is not finite or the iteration does not converge.
pub fn thin_svd(matrix: MatRef<'_, f64>) -> Result<ThinSvd, LinalgError> {
    let (rows, columns) = (matrix.nrows(), matrix.ncols());
    let failed = LinalgError::NoSpectrum { rows, columns };
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

fn is_finite_lower(matrix: MatRef<'_, f64>) -> bool {
    (0..matrix.ncols()).all(|col| (col..matrix.nrows()).all(|row| matrix[(row, col)].is_finite()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    #[test]
    fn eigenvalues_of_two_by_two_by_hand() {
        // [2 1; 1 2]: 1 along (1, −1), 3 along (1, 1). The upper triangle is not read.
        let eigen = symmetric_eigen(mat![[2.0, f64::NAN], [1.0, 2.0]].as_ref()).unwrap();
        let tolerance = 8.0 * f64::EPSILON * 3.0;
        assert!((eigen.values[0] - 1.0).abs() <= tolerance, "{eigen:?}");
        assert!((eigen.values[1] - 3.0).abs() <= tolerance, "{eigen:?}");
        let along = eigen.vectors[(0, 1)] * eigen.vectors[(1, 1)];
        assert!((along - 0.5).abs() <= tolerance, "{eigen:?}");
    }

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
            Err(LinalgError::NoSpectrum { rows: 2, .. })
        ));
        assert!(thin_svd(spoilt.as_ref()).is_err());
    }
}
