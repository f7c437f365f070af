//! A lower triangular matrix stored column after column, and its forward substitution.

use faer::{Mat, MatRef};

/// Columns that are eliminated together: one pass over the rest of the right-hand side.
const PANEL: usize = 4;

/// A lower triangular matrix L.
///
/// ```text
/// L_00 … L_{n−1,0}, L_11 … L_{n−1,1}, …, L_{n−1,n−1}
/// ```
/// # Source
/// Forward substitution by columns: Golub & Van Loan 2013, algorithm 3.1.3.
#[derive(Debug, Clone, PartialEq)]
pub struct PackedLower {
    order: usize,
    columns: Vec<f64>,
    inverse_diagonal: Vec<f64>,
}

impl PackedLower {
    /// The lower triangle of a square matrix.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn of(matrix: MatRef<'_, f64>) -> Self {
        let order = matrix.nrows();
        assert_eq!(order, matrix.ncols());
        let below = |col: usize| (col..order).map(move |row| matrix[(row, col)]);
        Self::from_columns(order, (0..order).flat_map(below).collect())
    }

    /// The matrix of given columns.
    ///
    /// # Panics
    /// If there are not n(n + 1)/2 entries.
    pub fn from_columns(order: usize, columns: Vec<f64>) -> Self {
        assert_eq!(columns.len(), order * (order + 1) / 2);
        let diagonal = (0..order).map(|col| columns[start_of(order, col)]);
        Self {
            order,
            inverse_diagonal: diagonal.map(f64::recip).collect(),
            columns,
        }
    }

    /// Order n.
    #[inline]
    pub fn order(&self) -> usize {
        self.order
    }

    /// Whether no entry of the diagonal is zero or has an infinite reciprocal.
    #[inline]
    pub fn is_invertible(&self) -> bool {
        let inverse = &self.inverse_diagonal;
        inverse.iter().all(|value| value.is_finite())
    }

    /// The entries, column after column, each from the diagonal down.
    #[inline]
    pub fn columns(&self) -> &[f64] {
        &self.columns
    }

    /// The square matrix, zero above the diagonal.
    pub fn to_mat(&self) -> Mat<f64> {
        let mut matrix = Mat::zeros(self.order, self.order);
        for col in 0..self.order {
            let start = start_of(self.order, col);
            let below = &self.columns[start..start + self.order - col];
            matrix.col_as_slice_mut(col)[col..].copy_from_slice(below);
        }
        matrix
    }

    /// Replaces b by L⁻¹b.
    ///
    /// The diagonal is applied by its reciprocals, which costs one rounding more
    /// than a division and leaves the substitution backward stable.
    /// # Panics
    /// If `rhs` does not have n entries.
    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the loop around it is compiled once per instruction set"
    )]
    pub fn solve_in_place(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.order);
        let mut rest = self.columns.as_slice();
        let mut col = 0;
        while col + PANEL < self.order {
            rest = self.eliminate_panel(rest, col, rhs);
            col += PANEL;
        }
        for col in col..self.order {
            let (column, after) = rest.split_at(self.order - col);
            let solved = rhs[col] * self.inverse_diagonal[col];
            rhs[col] = solved;
            for (value, l) in rhs[col + 1..].iter_mut().zip(&column[1..]) {
                *value -= solved * l;
            }
            rest = after;
        }
    }

    /// Solves for [`PANEL`] unknowns and takes their part out of all that follow.
    #[inline(always)]
    #[allow(
        clippy::inline_always,
        reason = "the loop around it is compiled once per instruction set"
    )]
    fn eliminate_panel<'a>(&self, columns: &'a [f64], col: usize, rhs: &mut [f64]) -> &'a [f64] {
        let height = self.order - col;
        let (a, rest) = columns.split_at(height);
        let (b, rest) = rest.split_at(height - 1);
        let (c, rest) = rest.split_at(height - 2);
        let (d, rest) = rest.split_at(height - 3);
        let inverse = &self.inverse_diagonal[col..col + PANEL];
        let (head, tail) = rhs[col..].split_at_mut(PANEL);

        head[0] *= inverse[0];
        head[1] = (head[1] - a[1] * head[0]) * inverse[1];
        head[2] = (head[2] - a[2] * head[0] - b[1] * head[1]) * inverse[2];
        head[3] = (head[3] - a[3] * head[0] - b[2] * head[1] - c[1] * head[2]) * inverse[3];

        let below = (a[4..].iter().zip(&b[3..])).zip(c[2..].iter().zip(&d[1..]));
        for (value, ((a, b), (c, d))) in tail.iter_mut().zip(below) {
            *value -= (a * head[0] + b * head[1]) + (c * head[2] + d * head[3]);
        }
        rest
    }
}

/// Where a column starts: all columns before it have order, order − 1, … entries.
fn start_of(order: usize, col: usize) -> usize {
    col * order - col * col.saturating_sub(1) / 2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// L_ij = 1 + i + j on the diagonal, 1/(1 + i + 2j) below: well conditioned for the orders here.
    fn example(order: usize) -> Mat<f64> {
        Mat::from_fn(order, order, |row, col| match row.cmp(&col) {
            std::cmp::Ordering::Less => 0.0,
            std::cmp::Ordering::Equal => 1.0 + (row + col) as f64,
            std::cmp::Ordering::Greater => 1.0 / (1 + row + 2 * col) as f64,
        })
    }

    #[test]
    fn packing_and_unpacking_keeps_every_entry() {
        for order in [0, 1, 4, 7] {
            assert_eq!(
                PackedLower::of(example(order).as_ref()).to_mat(),
                example(order)
            );
        }
    }

    #[test]
    fn forward_substitution_undoes_the_product_for_every_order() {
        for order in 0..24 {
            let l = example(order);
            let solution: Vec<f64> = (0..order).map(|i| (i as f64 - 3.5) * 0.75).collect();
            let mut rhs: Vec<f64> = (0..order)
                .map(|row| (0..=row).map(|col| l[(row, col)] * solution[col]).sum())
                .collect();
            PackedLower::of(l.as_ref()).solve_in_place(&mut rhs);
            // Diagonally dominant: the error stays at a few roundings of the row sums.
            let tolerance = 4.0 * (order + 2) as f64 * f64::EPSILON * 18.0;
            for (found, expected) in rhs.iter().zip(&solution) {
                assert!((found - expected).abs() <= tolerance, "{found} {expected}");
            }
        }
    }
}
