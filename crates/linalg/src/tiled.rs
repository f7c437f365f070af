//! The Cholesky factor of a large matrix, and the inverse from it, by tiles that many threads share.
//!
//! Tiles are as large as the order of the matrix says, and each of their products,
//! solves and factors is one sequential call: results are the same bit for bit for
//! any number of threads.
//! Factor, L⁻¹ and L⁻ᵀL⁻¹ cost n³/3 flops each.

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::reborrow::IntoConst;
use faer::{Accum, MatMut, MatRef, Par};

use crate::in_place::factorise_in_place;
use crate::threads::{Threads, column_panels, row_panels};

/// Products are cut to this many summands: their operands then stay in the second cache.
const SUMMANDS: usize = 256;

/// Rows and columns of a tile: large for the speed of products, at least ten across.
fn tile_size(order: usize) -> usize {
    (order / 10).next_multiple_of(64).clamp(128, 384)
}

/// Replaces the lower triangle of K by that of L, K = LLᵀ.
///
/// A panel of columns at a time, left-looking: first what the panels to its left
/// take away from it, then the factor of its tile on the diagonal, then the rows below.
/// # Errors
/// The index of the first pivot that is not a positive number.
/// # Source
/// Golub & Van Loan 2013, sec. 4.2.
pub(crate) fn factorise(mut k: MatMut<'_, f64>, threads: Threads) -> Result<(), usize> {
    let order = k.nrows();
    let size = tile_size(order);
    for first in (0..order).step_by(size) {
        let width = size.min(order - first);
        let (left, right) = k.as_mut().split_at_col_mut(first);
        let (left_beside, left_below) = (left.into_const())
            .subrows(first, order - first)
            .split_at_row(width);
        let (mut diagonal, mut below) = right
            .submatrix_mut(first, 0, order - first, width)
            .split_at_row_mut(width);

        let (outcome, ()) = threads.join(
            || {
                subtract_lower_product(diagonal.as_mut(), left_beside);
                factorise_in_place(diagonal.as_mut())
            },
            || {
                threads.for_each(row_panels(below.as_mut(), size / 2), |(row, tile)| {
                    let lhs = left_below.subrows(row, tile.nrows());
                    add_product(tile, lhs, left_beside.transpose(), -1.0);
                });
            },
        );
        outcome.map_err(|pivot| first + pivot)?;

        let diagonal = diagonal.into_const();
        threads.for_each(row_panels(below, size / 2), |(_, tile)| {
            solve_lower_triangular_in_place(diagonal, tile.transpose_mut(), Par::Seq);
        });
    }
    Ok(())
}

/// The lower triangle of L⁻ᵀL⁻¹ in place of that of L.
///
/// `scratch` is overwritten with L⁻¹ on and below the diagonal.
pub(crate) fn invert(l: MatMut<'_, f64>, mut scratch: MatMut<'_, f64>, threads: Threads) {
    invert_lower(l.as_ref(), scratch.as_mut(), threads);
    lower_of_gram(scratch.into_const(), l, threads);
}

/// L⁻¹ on and below the diagonal of `out`; its panels of columns do not depend on each other.
fn invert_lower(l: MatRef<'_, f64>, out: MatMut<'_, f64>, threads: Threads) {
    let order = l.nrows();
    let size = tile_size(order);
    threads.for_each(column_panels(out, size), |(first, panel)| {
        let rest = order - first;
        let l = l.submatrix(first, first, rest, rest);
        invert_panel(l, panel.subrows_mut(first, rest), size);
    });
}

/// The first columns of L⁻¹, by substitution a tile at a time.
///
/// ```text
/// L_ii X_i = −Σ_{k<i} L_ik X_k
/// ```
fn invert_panel(l: MatRef<'_, f64>, mut panel: MatMut<'_, f64>, size: usize) {
    let (order, width) = (panel.nrows(), panel.ncols());
    let corner = l.submatrix(0, 0, width, width);
    invert_lower_triangular(panel.as_mut().subrows_mut(0, width), corner, Par::Seq);
    for row in (width..order).step_by(size) {
        let height = size.min(order - row);
        let (above, rest) = panel.as_mut().split_at_row_mut(row);
        let (triangle, above) = above.into_const().split_at_row(width);
        let mut tile = rest.subrows_mut(0, height);
        triangular::matmul(
            tile.as_mut(),
            BlockStructure::Rectangular,
            Accum::Replace,
            l.submatrix(row, 0, height, width),
            BlockStructure::Rectangular,
            triangle,
            BlockStructure::TriangularLower,
            -1.0,
            Par::Seq,
        );
        let beside = l.submatrix(row, width, height, row - width);
        matmul(tile.as_mut(), Accum::Add, beside, above, -1.0, Par::Seq);
        solve_lower_triangular_in_place(l.submatrix(row, row, height, height), tile, Par::Seq);
    }
}

/// The lower triangle of XᵀX for a lower triangular X; its tiles do not depend on each other.
fn lower_of_gram(x: MatRef<'_, f64>, out: MatMut<'_, f64>, threads: Threads) {
    let size = tile_size(x.nrows());
    let mut tiles = Vec::new();
    for (col, panel) in column_panels(out, size) {
        let lower = panel.split_at_row_mut(col).1;
        for (row, tile) in row_panels(lower, size) {
            tiles.push((col + row, col, tile));
        }
    }
    tiles.sort_by_key(|&(row, col, _)| (row, col)); // the longest sums first
    threads.for_each(tiles, |(row, col, tile)| tile_of_gram(x, row, col, tile));
}

/// Σ_k X_kᵢᵀ X_kⱼ for the columns i from `row` on and j from `col` on, k from `row` on.
fn tile_of_gram(x: MatRef<'_, f64>, row: usize, col: usize, mut tile: MatMut<'_, f64>) {
    let (height, width, rest) = (tile.nrows(), tile.ncols(), x.nrows() - row);
    let (triangle, lhs) = x.submatrix(row, row, rest, height).split_at_row(height);
    let (beside, rhs) = x.submatrix(row, col, rest, width).split_at_row(height);
    let (of_tile, of_beside) = if row == col {
        (
            BlockStructure::TriangularLower,
            BlockStructure::TriangularLower,
        )
    } else {
        (BlockStructure::Rectangular, BlockStructure::Rectangular)
    };
    triangular::matmul(
        tile.as_mut(),
        of_tile,
        Accum::Replace,
        triangle.transpose(),
        BlockStructure::TriangularUpper,
        beside,
        of_beside,
        1.0,
        Par::Seq,
    );
    triangular::matmul(
        tile,
        of_tile,
        Accum::Add,
        lhs.transpose(),
        BlockStructure::Rectangular,
        rhs,
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// Takes the lower triangle of AAᵀ away from `out`.
fn subtract_lower_product(out: MatMut<'_, f64>, a: MatRef<'_, f64>) {
    triangular::matmul(
        out,
        BlockStructure::TriangularLower,
        Accum::Add,
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        -1.0,
        Par::Seq,
    );
}

/// Adds `factor`·AB to `out`.
fn add_product(mut out: MatMut<'_, f64>, a: MatRef<'_, f64>, b: MatRef<'_, f64>, factor: f64) {
    for first in (0..a.ncols()).step_by(SUMMANDS) {
        let taken = SUMMANDS.min(a.ncols() - first);
        let (a, b) = (a.subcols(first, taken), b.subrows(first, taken));
        matmul(out.as_mut(), Accum::Add, a, b, factor, Par::Seq);
    }
}

#[cfg(test)]
#[allow(
    clippy::float_cmp,
    reason = "the arithmetic of these matrices is exact"
)]
mod tests {
    use faer::Mat;

    use super::*;

    /// K_ij = 1 + min(i, j): L is 1 on and below the diagonal, and all of its arithmetic exact.
    fn counts(order: usize) -> Mat<f64> {
        Mat::from_fn(order, order, |i, j| 1.0 + i.min(j) as f64)
    }

    /// The inverse of [`counts`]: 2 on the diagonal (1 at its end), −1 beside it.
    fn inverse_of_counts(order: usize, i: usize, j: usize) -> f64 {
        match i - j {
            0 if i + 1 == order => 1.0,
            0 => 2.0,
            1 => -1.0,
            _ => 0.0,
        }
    }

    /// A matrix whose arithmetic rounds everywhere.
    fn rough(order: usize) -> Mat<f64> {
        Mat::from_fn(order, order, |i, j| {
            let distance = (i as f64 - j as f64) / 40.0;
            (-distance * distance).exp() + if i == j { 0.01 } else { 0.0 }
        })
    }

    fn factor_and_inverse(mut k: Mat<f64>, threads: Threads) -> (Mat<f64>, Mat<f64>) {
        threads.run(|| factorise(k.as_mut(), threads)).unwrap();
        let (mut inverse, mut scratch) = (k.clone(), Mat::zeros(k.nrows(), k.ncols()));
        threads.run(|| invert(inverse.as_mut(), scratch.as_mut(), threads));
        (k, inverse)
    }

    fn for_each_lower(order: usize, mut visit: impl FnMut(usize, usize)) {
        for j in 0..order {
            for i in j..order {
                visit(i, j);
            }
        }
    }

    #[test]
    fn factor_and_inverse_of_the_matrix_of_counts_are_exact() {
        for (order, threads) in [
            (100, Threads::Pool),
            (700, Threads::One),
            (1301, Threads::Pool),
        ] {
            let (l, inverse) = factor_and_inverse(counts(order), threads);
            for_each_lower(order, |i, j| {
                assert_eq!(l[(i, j)], 1.0, "L[{i}, {j}] of {order}");
                let expected = inverse_of_counts(order, i, j);
                assert_eq!(inverse[(i, j)], expected, "K⁻¹[{i}, {j}] of {order}");
            });
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let order = 1500; // large enough for tiles of another size than the least
        let (l, inverse) = factor_and_inverse(rough(order), Threads::One);
        for n_threads in 1..=3 {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads);
            let (l_too, inverse_too) =
                (pool.build().unwrap()).install(|| factor_and_inverse(rough(order), Threads::Pool));
            for_each_lower(order, |i, j| {
                assert_eq!(l[(i, j)].to_bits(), l_too[(i, j)].to_bits());
                assert_eq!(inverse[(i, j)].to_bits(), inverse_too[(i, j)].to_bits());
            });
        }
    }
}
