//! Which of a few candidates become pivots: a small Cholesky factorisation with pivoting.

use faer::Mat;

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
/// Golub & Van Loan 2013, algorithm 4.2.2 (outer product with pivoting).
pub(crate) fn choose_pivots(
    mut schur: Mat<f64>,
    max_count: usize,
    floor: f64,
    fraction: f64,
) -> Choice {
    let m = schur.nrows();
    let mut left: Vec<usize> = (0..m).collect();
    let mut order = Vec::new();
    let mut threshold = floor;
    while order.len() < max_count.min(m) {
        let Some((place, pivot)) = largest(&schur, &left) else {
            break;
        };
        if pivot <= threshold {
            break;
        }
        if order.is_empty() {
            threshold = floor.max(fraction * pivot);
        }
        let idx = left.swap_remove(place);
        order.push(idx);
        eliminate(&mut schur, idx, pivot, &left);
    }

    // Column idx of `schur` now holds the column of the factor for pivot idx.
    let l = Mat::from_fn(order.len(), order.len(), |row, col| {
        if row >= col {
            schur[(order[row], order[col])]
        } else {
            0.0
        }
    });
    Choice { order, l }
}

/// Place in `left` of the largest diagonal entry, the earliest sample of equals.
fn largest(schur: &Mat<f64>, left: &[usize]) -> Option<(usize, f64)> {
    let mut best: Option<(usize, f64)> = None;
    for (place, &idx) in left.iter().enumerate() {
        let value = schur[(idx, idx)];
        let is_better = best.is_none_or(|(at, size)| {
            value > size || (value.total_cmp(&size).is_eq() && idx < left[at])
        });
        if value.is_finite() && is_better {
            best = Some((place, value));
        }
    }
    best
}

/// Scales column `pivot_idx` by its pivot and subtracts its outer product from what is left.
fn eliminate(schur: &mut Mat<f64>, pivot_idx: usize, pivot: f64, left: &[usize]) {
    let root = pivot.sqrt();
    let mut column = schur.col_as_slice(pivot_idx).to_vec();
    column[pivot_idx] = root;
    for &idx in left {
        column[idx] /= root;
    }
    for &idx in left {
        let factor = column[idx];
        let target = schur.col_as_slice_mut(idx);
        // Rows already chosen are not read again, so whole columns are updated.
        for (target, value) in target.iter_mut().zip(&column) {
            *target -= factor * value;
        }
    }
    schur.col_as_slice_mut(pivot_idx).copy_from_slice(&column);
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::mat;

    #[test]
    fn largest_pivots_come_first_and_their_block_is_factorised() {
        let k = mat![[4.0, 2.0, 0.0], [2.0, 9.0, 3.0], [0.0, 3.0, 1.0]];
        // Pivots 9, then 4 − 4/9 = 32/9; the third is 1 − 1 − (2/3)²/(32/9) < 0.
        let choice = choose_pivots(k.clone(), 3, 0.0, 0.0);
        assert_eq!(choice.order, [1, 0]);
        let back = &choice.l * choice.l.transpose();
        assert!((back[(0, 0)] - 9.0).abs() < 1e-14 && (back[(1, 1)] - 4.0).abs() < 1e-14);
        assert!((back[(1, 0)] - 2.0).abs() < 1e-14);
        assert_eq!(choose_pivots(k.clone(), 3, 0.0, 0.5).order, [1]);
        assert_eq!(choose_pivots(k, 3, 10.0, 0.0).order, []);
    }

    #[test]
    fn no_pivot_is_not_a_number() {
        let k = mat![[f64::NAN, f64::NAN], [f64::NAN, f64::NAN]];
        assert_eq!(choose_pivots(k, 2, 0.0, 0.0).order, []);
    }
}
