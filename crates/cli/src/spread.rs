//! Some rows of many, evenly spread.

use faer::{Mat, MatRef};

/// Indices of at most `most` of `n` rows, ascending and evenly spread.
pub fn spread(n: usize, most: usize) -> Vec<usize> {
    let count = n.min(most);
    (0..count).map(|idx| idx * n / count).collect()
}

/// Rows of a matrix by their indices.
pub fn rows_of(x: MatRef<'_, f64>, rows: &[usize]) -> Mat<f64> {
    Mat::from_fn(rows.len(), x.ncols(), |row, col| x[(rows[row], col)])
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn few_are_all_and_many_are_spread() {
        assert_eq!(spread(3, 5), [0, 1, 2]);
        assert_eq!(spread(10, 4), [0, 2, 5, 7]);
        assert!(spread(0, 4).is_empty());
    }
}
