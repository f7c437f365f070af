//! The rank-r part of a task matrix, as a truncated lower-triangular factor.
//!
//! Any B with BBᵀ = K_r takes that form by a rotation of its columns:
//! see [`TaskFactor::from_root`].
//! Source: A.3.2, last paragraph ("either … the top r eigenvectors/values, or …
//! an incomplete Cholesky decomposition").

use faer::{Mat, MatRef, Side};

use crate::error::MtgpError;
use crate::prior::task_cov::TaskFactor;

/// How the rank-r part is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RankPart {
    /// The top r eigenpairs: the nearest matrix of rank r.
    #[default]
    Eigenpairs,
    /// r steps of pivoted Cholesky: equal to K in r rows and columns.
    IncompleteCholesky,
}

/// Λ of the rank-r part of a symmetric positive semi-definite matrix.
///
/// Columns beyond the rank of `k` are zero.
/// # Shapes
/// `k` (m, m), of which the lower triangle is read.
/// # Errors
/// [`MtgpError::BadRank`] for a rank of 0 or above m; [`MtgpError::NonFinite`] if `k`
/// is not finite.
/// # Panics
/// If `k` is not square.
/// # Source
/// A.3.2.
pub fn rank_part(k: MatRef<'_, f64>, rank: usize, by: RankPart) -> Result<TaskFactor, MtgpError> {
    let n_tasks = k.nrows();
    assert_eq!(n_tasks, k.ncols());
    if rank == 0 || rank > n_tasks {
        return Err(MtgpError::BadRank { rank, n_tasks });
    }
    let root = match by {
        RankPart::Eigenpairs => top_eigenpairs(k, rank),
        RankPart::IncompleteCholesky => pivoted_columns(k, rank).0,
    };
    TaskFactor::from_root(root.as_ref())
}

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

#[cfg(test)]
mod tests {
    use super::*;

    /// A = GGᵀ with G_ab = 1/(1 + a + 2b) + [a = b].
    fn matrix() -> Mat<f64> {
        let g = Mat::from_fn(4, 4, |a, b| {
            1.0 / (1 + a + 2 * b) as f64 + f64::from(u8::from(a == b))
        });
        &g * g.transpose()
    }

    fn product(k: MatRef<'_, f64>, rank: usize, by: RankPart) -> Mat<f64> {
        let factor = rank_part(k, rank, by).unwrap();
        factor.lambda() * factor.lambda().transpose()
    }

    fn largest_difference(a: &Mat<f64>, b: &Mat<f64>) -> f64 {
        (a - b).norm_max()
    }

    #[test]
    fn full_rank_part_is_the_matrix_itself() {
        let k = matrix();
        for by in [RankPart::Eigenpairs, RankPart::IncompleteCholesky] {
            let product = product(k.as_ref(), 4, by);
            let tolerance = 64.0 * f64::EPSILON * k.norm_l2();
            assert!(
                largest_difference(&product, &k) <= tolerance,
                "{by:?} {product:?}"
            );
        }
    }

    #[test]
    fn eigenpairs_leave_the_sum_of_squared_smaller_eigenvalues() {
        let k = matrix();
        let eigenvalues = k.self_adjoint_eigenvalues(Side::Lower).unwrap();
        for rank in 1..4 {
            let left = &k - product(k.as_ref(), rank, RankPart::Eigenpairs);
            let squares: f64 = eigenvalues[..4 - rank].iter().map(|v| v * v).sum();
            let error = (left.norm_l2() - squares.sqrt()).abs();
            assert!(error <= 64.0 * f64::EPSILON * k.norm_l2(), "{rank} {error}");
        }
    }

    #[test]
    fn incomplete_cholesky_agrees_in_the_row_of_its_pivot() {
        let k = matrix();
        let part = product(k.as_ref(), 1, RankPart::IncompleteCholesky);
        let pivot = (0..4)
            .max_by(|&a, &b| k[(a, a)].total_cmp(&k[(b, b)]))
            .unwrap();
        for row in 0..4 {
            let entry = part[(row, pivot)];
            assert!((entry - k[(row, pivot)]).abs() <= 16.0 * f64::EPSILON * k.norm_l2());
        }
    }

    #[test]
    fn matrix_of_lower_rank_leaves_zero_columns() {
        let ones = Mat::full(3, 3, 4.0);
        for by in [RankPart::Eigenpairs, RankPart::IncompleteCholesky] {
            let factor = rank_part(ones.as_ref(), 2, by).unwrap();
            let lambda = factor.lambda();
            assert!((lambda[(2, 0)].abs() - 2.0).abs() < 1e-14, "{lambda:?}");
            // √ of an eigenvalue that is zero to rounding.
            assert!(lambda.col(1).norm_max() < 1e-7, "{lambda:?}");
        }
    }

    #[test]
    fn matrix_that_is_not_finite_is_refused() {
        let nan = Mat::full(2, 2, f64::NAN);
        for by in [RankPart::Eigenpairs, RankPart::IncompleteCholesky] {
            assert!(rank_part(nan.as_ref(), 1, by).is_err(), "{by:?}");
        }
    }
}
