//! Matrix columns as contiguous slices, over which loops vectorise.

use faer::{MatMut, MatRef};

/// Column `col_idx` as a slice.
///
/// # Panics
/// If the columns of the matrix are not contiguous.
#[inline]
pub fn column_mut<'a>(matrix: &'a mut MatMut<'_, f64>, col_idx: usize) -> &'a mut [f64] {
    matrix
        .as_mut()
        .col_mut(col_idx)
        .try_as_col_major_mut()
        .expect("the columns of an output matrix are contiguous")
        .as_slice_mut()
}

/// Runs `visit` on every column, as a slice if it is one and as a copy if not.
///
/// Inputs come from callers, who may hand over a transposed view.
#[inline]
pub fn for_each_column(matrix: MatRef<'_, f64>, mut visit: impl FnMut(usize, &[f64])) {
    let mut copy = Vec::new();
    for (col_idx, col) in matrix.col_iter().enumerate() {
        if let Some(contiguous) = col.try_as_col_major() {
            visit(col_idx, contiguous.as_slice());
        } else {
            copy.clear();
            copy.extend(col.iter().copied());
            visit(col_idx, &copy);
        }
    }
}
