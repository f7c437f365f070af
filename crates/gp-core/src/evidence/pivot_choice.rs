//! Which of a few candidates become pivots: a small Cholesky factorisation with pivoting.

use faer::linalg::matmul::matmul;
use faer::{Accum, ColMut, Mat, MatRef, Par};

/// The pivots chosen, with the factor of their block.
pub(crate) struct Choice {
    /// Candidates chosen, largest first.
    pub order: Vec<usize>,
    /// Lower factor of the block of the chosen candidates, zero above the diagonal.
    pub l: Mat<f64>,
}

/// Chooses the largest pivots of a positive semi-definite matrix, one after the other.
///
/// It stops after `max_count`, at the first pivot that is not above `floor`, and at
/// the first that is not above `fraction` of the first.
/// A pivot that is NaN is never chosen.
/// # Source
/// Golub & Van Loan 2013, algorithm 4.2.2 (pivoting), with the columns made when they are needed
/// (algorithm 4.2.1, gaxpy).
pub(crate) fn choose_pivots(
    schur: MatRef<'_, f64>,
    max_count: usize,
    floor: f64,
    fraction: f64,
) -> Choice {
    let m = schur.nrows();
    let max_count = max_count.min(m);
    // What is left of the diagonal; −∞ where a pivot has been taken.
    let mut left: Vec<f64> = (0..m).map(|idx| schur[(idx, idx)]).collect();
    let mut columns = Mat::zeros(m, max_count); // of the factor, rows not permuted
    let mut order = Vec::new();
    let mut threshold = floor;
    while order.len() < max_count {
        let Some((idx, pivot)) = largest(&left) else {
            break;
        };
        if pivot <= threshold {
            break;
        }
        if order.is_empty() {
            threshold = floor.max(fraction * pivot);
        }
        let (done, mut rest) = columns.as_mut().split_at_col_mut(order.len());
        let column = rest.as_mut().col_mut(0).try_as_col_major_mut();
        let column = column.expect("a matrix is column-major").as_slice_mut();
        column.copy_from_slice(
            schur
                .col(idx)
                .try_as_col_major()
                .expect("as above")
                .as_slice(),
        );
        subtract_earlier(done.as_ref(), idx, column);
        scale_by_pivot(column, idx, pivot);
        for (left, value) in left.iter_mut().zip(&*column) {
            *left -= value * value;
        }
        left[idx] = f64::NEG_INFINITY;
        order.push(idx);
    }

    let l = Mat::from_fn(order.len(), order.len(), |row, col| {
        if row >= col {
            columns[(order[row], col)]
        } else {
            0.0
        }
    });
    Choice { order, l }
}

/// The largest finite value, the earliest of equals.
fn largest(left: &[f64]) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for (idx, &value) in left.iter().enumerate() {
        if value.is_finite() && best.is_none_or(|(_, size)| value > size) {
            best = Some((idx, value));
        }
    }
    best
}

/// column −= Σ_k L_k L_(idx, k) over the columns made before.
fn subtract_earlier(done: MatRef<'_, f64>, idx: usize, column: &mut [f64]) {
    matmul(
        ColMut::from_slice_mut(column),
        Accum::Add,
        done,
        done.row(idx).transpose(),
        -1.0,
        Par::Seq,
    );
}

/// Divides the column by the root of its pivot, and makes the pivot exact.
fn scale_by_pivot(column: &mut [f64], idx: usize, pivot: f64) {
    let root = pivot.sqrt();
    for value in column.iter_mut() {
        *value /= root;
    }
    column[idx] = root;
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    #[test]
    fn largest_pivots_come_first_and_their_block_is_factorised() {
        let k = mat![[4.0, 2.0, 0.0], [2.0, 9.0, 3.0], [0.0, 3.0, 1.0]];
        // Pivots 9, then 4 − 4/9 = 32/9; the third is 1 − 1 − (2/3)²/(32/9) < 0.
        let choice = choose_pivots(k.as_ref(), 3, 0.0, 0.0);
        assert_eq!(choice.order, [1, 0]);
        let back = &choice.l * choice.l.transpose();
        assert!((back[(0, 0)] - 9.0).abs() < 1e-14 && (back[(1, 1)] - 4.0).abs() < 1e-14);
        assert!((back[(1, 0)] - 2.0).abs() < 1e-14);
        assert_eq!(choose_pivots(k.as_ref(), 3, 0.0, 0.5).order, [1]);
        assert_eq!(choose_pivots(k.as_ref(), 3, 10.0, 0.0).order, []);
    }

    #[test]
    fn no_pivot_is_not_a_number() {
        let k = mat![[f64::NAN, f64::NAN], [f64::NAN, f64::NAN]];
        assert_eq!(choose_pivots(k.as_ref(), 2, 0.0, 0.0).order, []);
    }
}
