//! Roots B of the rank-r part of a symmetric positive semi-definite matrix, BBᵀ = K_r.

use faer::{Mat, MatRef, Side};

/// B = U_r D_r^½ of the r largest eigenvalues, (m, r); NaN if there are none.
pub(crate) fn top_eigenpairs(k: MatRef<'_, f64>, rank: usize) -> Mat<f64> {
    let order = k.nrows();
    let Ok(eigen) = k.self_adjoint_eigen(Side::Lower) else {
        return Mat::full(order, rank, f64::NAN);
    };
    // Eigenvalues are in ascending order.
    Mat::from_fn(order, rank, |row, col| {
        let idx = order - 1 - col;
        eigen.U()[(row, idx)] * eigen.S()[idx].max(0.0).sqrt()
    })
}

/// The first r columns of the pivoted Cholesky factor, (m, r), rows in their own order, and the pivots.
///
/// Where nothing is left to factorise, further columns are zero and have no pivot.
pub(crate) fn pivoted_columns(k: MatRef<'_, f64>, rank: usize) -> (Mat<f64>, Vec<usize>) {
    let order = k.nrows();
    let symmetric = |a: usize, b: usize| k[(a.max(b), a.min(b))];
    let mut factor = Mat::<f64>::zeros(order, rank);
    let mut pivots = Vec::new();
    let mut residual: Vec<f64> = (0..order).map(|idx| k[(idx, idx)]).collect();
    let largest = residual.iter().copied().fold(0.0, f64::max);
    for col in 0..rank {
        let pivot = (0..order).fold(0, |best, idx| {
            if residual[idx] > residual[best] {
                idx
            } else {
                best
            }
        });
        // A residual is the difference of a diagonal entry and up to m squares.
        let noise = order as f64 * f64::EPSILON * largest;
        if residual[pivot] <= noise {
            break;
        }
        pivots.push(pivot);
        let root = residual[pivot].sqrt();
        for row in 0..order {
            let known: f64 = (0..col)
                .map(|c| factor[(row, c)] * factor[(pivot, c)])
                .sum();
            factor[(row, col)] = (symmetric(row, pivot) - known) / root;
            residual[row] -= factor[(row, col)].powi(2);
        }
        residual[pivot] = 0.0;
    }
    (factor, pivots)
}
