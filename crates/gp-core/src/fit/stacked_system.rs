//! Least squares with a prior as one triangle: rows of data above rows of the prior.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{
    QrParams, qr_in_place, qr_in_place_scratch, recommended_block_size,
};
use faer::{Auto, Mat, MatRef, Par, Spec};

/// R of the QR decomposition of the stacked system with its right-hand side as last column.
///
/// ```text
/// [ X̃  t ]
/// [ P  0 ]      P the rows of the prior: (σ/τ)I in eq. (9)
/// ```
/// Its leading (p, p) block is R, and above the corner the last column is Qᵀ(t, 0).
pub(super) fn r_with_targets(
    features: &Mat<f64>,
    targets: &[f64],
    prior_rows: MatRef<'_, f64>,
) -> Mat<f64> {
    let (n, p) = (features.nrows(), features.ncols());
    // One row more than unknowns, so that the last column has a place for its residual.
    let mut stacked = Mat::from_fn(n + p + 1, p + 1, |row, col| {
        if row < n {
            if col < p {
                features[(row, col)]
            } else {
                targets[row]
            }
        } else if row - n < p && col < p {
            prior_rows[(row - n, col)]
        } else {
            0.0
        }
    });

    let (rows, cols) = (stacked.nrows(), stacked.ncols());
    let block_size = recommended_block_size::<f64>(rows, cols);
    let mut coefficients = Mat::zeros(block_size, cols);
    let params: Spec<QrParams, f64> = <QrParams as Auto<f64>>::auto().into();
    let scratch = qr_in_place_scratch::<f64>(rows, cols, block_size, Par::Seq, params);
    let mut memory = MemBuffer::new(scratch);
    qr_in_place(
        stacked.as_mut(),
        coefficients.as_mut(),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    );
    stacked.submatrix(0, 0, cols, cols).to_owned()
}
