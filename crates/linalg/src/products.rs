//! Products of matrices in one thread, and symmetric results made whole.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// a b
///
/// # Panics
/// If a does not have as many columns as b has rows.
pub fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>) -> Mat<f64> {
    let mut out = Mat::zeros(a.nrows(), b.ncols());
    matmul(out.as_mut(), Accum::Replace, a, b, 1.0, Par::Seq);
    out
}

/// out += factor · vᵀv
pub fn add_inner_product(out: &mut Mat<f64>, factor: f64, v: MatRef<'_, f64>) {
    matmul(out.as_mut(), Accum::Add, v.transpose(), v, factor, Par::Seq);
}

/// Copies the lower triangle to the upper one.
pub fn mirror(matrix: &mut Mat<f64>) {
    for col in 1..matrix.ncols() {
        for row in 0..col {
            matrix[(row, col)] = matrix[(col, row)];
        }
    }
}
