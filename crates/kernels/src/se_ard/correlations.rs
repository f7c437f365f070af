//! Correlations e^{−s/2} between scaled inputs.
//!
//! Squared distances come from one matrix product of the centred and scaled
//! inputs z = (x − x̄)/l,
//!
//! ```text
//! s_ab = |z_a|² + |z_b|² − 2 z_a·z_b,   clamped at 0
//! ```
//!
//! whose absolute error is at most about 2(d + 2) ε max|z|², so a covariance of
//! v² e^{−s/2} carries the relative error (d + 2) ε max|z|².
//! Centring keeps |z| at the spread of the data instead of its offset.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use linalg::sums::sum;
use linalg::{column_mut, exp, for_each_column};

/// Columns of the Gram matrix that are worked on together: their block stays in cache.
pub(crate) const BLOCK: usize = 64;

/// Columns between `n_rows` inputs and others that are worked on together.
///
/// Their block, of 256 kB at most where 8 columns allow it, stays in the second cache.
pub(crate) fn cross_block(n_rows: usize) -> usize {
    (32_768 / n_rows.max(1)).clamp(8, BLOCK)
}

/// Inputs centred and divided by the length scales, with their squared norms.
pub(crate) struct Scaled {
    pub z: Mat<f64>,        // (n, d)
    pub sq_norms: Vec<f64>, // (n,)
}

/// Mean of every column.
pub(crate) fn column_means(x: MatRef<'_, f64>) -> Vec<f64> {
    let mut means = vec![0.0; x.ncols()];
    for_each_column(x, |col, column| {
        means[col] = sum(column) / column.len() as f64;
    });
    means
}

/// Fills `out` with the inner products between some rows of `a` and some rows of `b`.
///
/// # Shapes
/// `out` (rows_a.len(), rows_b.len()).
pub(crate) fn products(
    a: &Scaled,
    rows_a: Range<usize>,
    b: &Scaled,
    rows_b: Range<usize>,
    out: MatMut<'_, f64>,
) {
    let z_a = a.z.as_ref().subrows(rows_a.start, rows_a.len());
    let z_b = b.z.as_ref().subrows(rows_b.start, rows_b.len());
    matmul(out, Accum::Replace, z_a, z_b.transpose(), 1.0, Par::Seq);
}

/// Fills `out` with e^{−s/2} between some rows of `a` and some rows of `b`.
///
/// # Shapes
/// `out` (rows_a.len(), rows_b.len()), contiguous columns.
pub(crate) fn correlations(
    a: &Scaled,
    rows_a: Range<usize>,
    b: &Scaled,
    rows_b: Range<usize>,
    mut out: MatMut<'_, f64>,
) {
    products(a, rows_a.clone(), b, rows_b.clone(), out.as_mut());
    let sq_a = &a.sq_norms[rows_a];
    for (col, sq_b) in b.sq_norms[rows_b].iter().enumerate() {
        let column = column_mut(&mut out, col);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (value, sq_a) in column.iter_mut().zip(sq_a) {
                    *value = exp(exponent(*value, *sq_a, *sq_b));
                }
            },
        );
    }
}

/// −s/2 = z_a·z_b − (|z_a|² + |z_b|²)/2, at most 0; the comparison lets NaN through.
#[inline(always)]
#[allow(
    clippy::inline_always,
    reason = "the loop around it is compiled once per instruction set"
)]
fn exponent(product: f64, sq_a: f64, sq_b: f64) -> f64 {
    let exponent = product - 0.5 * (sq_a + sq_b);
    if exponent > 0.0 { 0.0 } else { exponent }
}

/// out += v² e^{−s/2} for one column of inner products.
pub(crate) fn add_covariances(
    products: &[f64],
    sq_a: &[f64],
    sq_b: f64,
    signal_var: f64,
    out: &mut [f64],
) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for ((value, product), sq_a) in out.iter_mut().zip(products).zip(sq_a) {
                *value += signal_var * exp(exponent(*product, *sq_a, sq_b));
            }
        },
    );
}

/// out += factor · values
pub(crate) fn add_scaled(out: &mut [f64], values: &[f64], factor: f64) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for (out, value) in out.iter_mut().zip(values) {
                *out += factor * value;
            }
        },
    );
}
