//! Subsets of the samples, each inside the next.

use faer::{Mat, MatRef};

use super::pivoted::rows;

/// Rows of the first `n` samples of a fixed order that spreads every part of it over the data.
///
/// ```text
/// row i comes before row j  if  frac(i φ) < frac(j φ),   φ = (√5 − 1)/2
/// ```
/// So the subsets of one data set lie inside each other.
/// Of samples in order of time a subset takes rows at nearly even, never periodic
/// distances; of shuffled samples it is a subset like any other.
/// The result is ascending.
/// # Panics
/// If there are fewer than `n` samples.
/// # Source
/// The golden ratio's multiples are the most evenly spread: Knuth, The Art of
/// Computer Programming 3, sec. 6.4, theorem S.
pub fn spread_rows(n_samples: usize, n: usize) -> Vec<usize> {
    assert!(n <= n_samples);
    let mut order: Vec<usize> = (0..n_samples).collect();
    order.sort_by_key(|&row| golden_fraction(row));
    order.truncate(n);
    order.sort_unstable();
    order
}

/// frac(row φ) as a fraction of 2⁶⁴, exact in integers.
fn golden_fraction(row: usize) -> u64 {
    const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15; // round(2⁶⁴ φ) to odd; Knuth, ibid.
    GOLDEN.wrapping_mul(row as u64)
}

/// The samples of some rows.
pub(crate) fn subset(x: MatRef<'_, f64>, targets: &[f64], of: &[usize]) -> (Mat<f64>, Vec<f64>) {
    (rows(x, of), of.iter().map(|&row| targets[row]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subsets_lie_inside_each_other() {
        let (small, large) = (spread_rows(1000, 60), spread_rows(1000, 250));
        assert!(small.iter().all(|row| large.contains(row)));
        assert_eq!(spread_rows(1000, 1000), (0..1000).collect::<Vec<_>>());
    }

    #[test]
    fn rows_are_at_nearly_even_distances() {
        // Three distances at most occur between neighbours (Knuth, theorem S), of which
        // the largest is below φ⁻² + 1 ≈ 3.7 times the mean for any count.
        let rows = spread_rows(4000, 250);
        let gaps: Vec<usize> = rows.windows(2).map(|w| w[1] - w[0]).collect();
        let mut kinds = gaps.clone();
        kinds.sort_unstable();
        kinds.dedup();
        assert!(kinds.len() <= 3, "{kinds:?}");
        assert!(gaps.iter().all(|&gap| gap < 60), "{kinds:?}");
    }
}
