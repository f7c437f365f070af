//! A lower triangular matrix times a few vectors: each row is read once for all of them.

use faer::MatRef;

use crate::sums::dot_in_lanes;

/// A lower triangular matrix of order b, its rows one after another up to the diagonal.
#[derive(Debug, Clone)]
pub struct TriangularRows {
    order: usize,
    entries: Vec<f64>,
}

impl TriangularRows {
    /// The lower triangle of a square matrix.
    pub fn lower(matrix: MatRef<'_, f64>) -> Self {
        let order = matrix.nrows();
        let row = |row: usize| (0..=row).map(move |col| matrix[(row, col)]);
        Self {
            order,
            entries: (0..order).flat_map(row).collect(),
        }
    }

    /// Writes the product with each of some vectors.
    ///
    /// # Shapes
    /// `vectors` and `products` (p, b), vector after vector.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn multiply(&self, vectors: &[f64], products: &mut [f64]) {
        let mut rest = self.entries.as_slice();
        for row in 0..self.order {
            let (entries, after) = rest.split_at(row + 1);
            let pairs =
                (vectors.chunks_exact(self.order)).zip(products.chunks_exact_mut(self.order));
            for (vector, product) in pairs {
                product[row] = dot_in_lanes(entries, &vector[..=row]);
            }
            rest = after;
        }
    }
}

#[cfg(test)]
mod tests {
    use faer::Mat;

    use super::*;

    #[test]
    fn products_are_those_of_the_square_matrix() {
        // Whole numbers: every sum is exact in double precision.
        for order in [0_usize, 1, 7, 8, 9, 20] {
            let whole = Mat::from_fn(order, order, |row, col| (3 * row + 7 * col + 1) as f64);
            let vectors: Vec<f64> = (0..2 * order).map(|i| i as f64 - 5.0).collect();
            let mut products = vec![0.0; 2 * order];
            TriangularRows::lower(whole.as_ref()).multiply(&vectors, &mut products);
            for (idx, product) in products.iter().enumerate() {
                let (vector, row) = (idx / order, idx % order);
                let expected: f64 = (0..=row)
                    .map(|col| whole[(row, col)] * vectors[vector * order + col])
                    .sum();
                assert!((product - expected).abs() < 0.5, "{order} {idx}");
            }
        }
    }
}
