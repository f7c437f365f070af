//! Weighted sums over the correlations of the squared-exponential term, for its gradient.
//!
//! Correlations are made a block of columns at a time, weighted with the adjoint
//! and summed; no matrix of the size of the Gram matrix is stored.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use linalg::sums::{dot, sum_in_lanes, weighted_squares};
use linalg::{column_mut, for_each_column};

use crate::se_ard::correlations::{BLOCK, Scaled, correlations, cross_block};

/// Sums over the lower triangle of W = Q ∘ E, or over one block of its columns.
pub(crate) struct LowerSums {
    first: usize,           // column that the block begins with
    pub diagonal: f64,      // Σ_a W_aa
    pub below: f64,         // Σ_{a>b} W_ab
    pub weights: Vec<f64>,  // row sum plus column sum of the strictly lower W, from row `first` on
    pub products: Vec<f64>, // (d,) Σ_{a>b} W_ab z_aj z_bj
    wz: Mat<f64>,           // (BLOCK, d) scratch
}

impl LowerSums {
    /// Zeros, for the columns from `first` on.
    pub fn new(n: usize, d: usize, first: usize) -> Self {
        Self {
            first,
            diagonal: 0.0,
            below: 0.0,
            weights: vec![0.0; n - first],
            products: vec![0.0; d],
            wz: Mat::zeros(BLOCK, d),
        }
    }

    /// The sum of all blocks, in their order.
    pub fn total(n: usize, d: usize, blocks: &[Self]) -> Self {
        let mut total = Self::new(n, d, 0);
        for block in blocks {
            total.diagonal += block.diagonal;
            total.below += block.below;
            add(&mut total.weights[block.first..], &block.weights);
            add(&mut total.products, &block.products);
        }
        total
    }

    /// Adds the rows `row..` whose correlations `tile` holds, and overwrites it with W.
    pub fn add_tile(
        &mut self,
        z: &Mat<f64>,
        adjoint: MatRef<'_, f64>,
        row: usize,
        mut tile: MatMut<'_, f64>,
    ) {
        let (height, width) = (tile.nrows(), tile.ncols());
        let q = adjoint.submatrix(row, self.first, height, width);
        let offset = row - self.first; // 0 only for the tile that holds the diagonal
        for_each_column(q, |k, q_column| {
            let w = column_mut(&mut tile, k);
            let start = if offset == 0 {
                self.diagonal += q_column[k] * w[k];
                w[..=k].fill(0.0);
                k + 1
            } else {
                0
            };
            let row_sums = &mut self.weights[offset + start..];
            let column_sum = weigh_column(&mut w[start..], &q_column[start..], row_sums);
            self.weights[k] += column_sum;
            self.below += column_sum;
        });

        // Rows of WᵀZ for this block's columns, then Σ_b z_bj (WᵀZ)_bj.
        let z_rows = z.as_ref().subrows(row, height);
        let mut wz = self.wz.as_mut().subrows_mut(0, width); // (width, d)
        matmul(
            wz.as_mut(),
            Accum::Replace,
            tile.transpose(),
            z_rows,
            1.0,
            Par::Seq,
        );
        for (j, product) in self.products.iter_mut().enumerate() {
            let z_block = &z.col_as_slice(j)[self.first..self.first + width];
            *product += dot(z_block, column_mut(&mut wz, j));
        }
    }
}

fn add(total: &mut [f64], part: &[f64]) {
    for (total, part) in total.iter_mut().zip(part) {
        *total += part;
    }
}

/// Sums over all of W = Q ∘ E between two sets of inputs.
pub(crate) struct CrossSums {
    pub total: f64,        // Σ_ab W_ab
    pub squares: Vec<f64>, // (d,) Σ_ab W_ab (z1_aj − z2_bj)²
}

impl CrossSums {
    /// # Shapes
    /// `adjoint` Q, (n1, n2).
    pub fn new(first: &Scaled, second: &Scaled, adjoint: MatRef<'_, f64>) -> Self {
        let (n1, n2, d) = (first.z.nrows(), second.z.nrows(), first.z.ncols());
        let mut row_sums = vec![0.0; n1]; // Σ_b W_ab
        let mut column_sums = vec![0.0; n2]; // Σ_a W_ab
        let mut products = Mat::zeros(n2, d); // WᵀZ1, (n2, d)
        let block_size = cross_block(n1);
        let mut buffer = Mat::zeros(n1, block_size.min(n2)); // (n1, block_size)
        for start in (0..n2).step_by(block_size) {
            let width = block_size.min(n2 - start);
            let mut block = buffer.as_mut().subcols_mut(0, width);
            correlations(first, 0..n1, second, start..start + width, block.as_mut());
            for_each_column(adjoint.subcols(start, width), |k, q_column| {
                let w_column = column_mut(&mut block, k);
                column_sums[start + k] = weigh_column(w_column, q_column, &mut row_sums);
            });
            matmul(
                products.as_mut().subrows_mut(start, width),
                Accum::Replace,
                block.transpose(),
                first.z.as_ref(),
                1.0,
                Par::Seq,
            );
        }
        Self {
            total: column_sums.iter().sum(),
            squares: (0..d)
                .map(|j| {
                    let (z1, z2) = (first.z.col_as_slice(j), second.z.col_as_slice(j));
                    weighted_squares(z1, &row_sums) + weighted_squares(z2, &column_sums)
                        - 2.0 * dot(z2, products.col_as_slice(j))
                })
                .collect(),
        }
    }
}

/// w ← w ∘ q; adds w to the row sums and returns its sum.
fn weigh_column(w: &mut [f64], q: &[f64], row_sums: &mut [f64]) -> f64 {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for ((w, q), row_sum) in w.iter_mut().zip(q).zip(row_sums) {
                *w *= q;
                *row_sum += *w;
            }
            sum_in_lanes(w)
        },
    )
}
