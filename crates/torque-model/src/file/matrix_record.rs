//! Matrices, triangles and lists as plain records, and the checks that turn them back.
//!
//! A matrix is its numbers of rows and columns and its columns one after another;
//! a triangle is its order and its columns from the diagonal down.

use faer::{Mat, MatRef};
use linalg::PackedLower;
use serde::{Deserialize, Serialize};

use crate::file::format::ModelFileError;

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct MatrixRecord {
    n_rows: usize,
    n_cols: usize,
    columns: Vec<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct TriangleRecord {
    order: usize,
    columns: Vec<f64>,
}

impl MatrixRecord {
    pub fn of(matrix: MatRef<'_, f64>) -> Self {
        let columns = matrix.col_iter();
        Self {
            n_rows: matrix.nrows(),
            n_cols: matrix.ncols(),
            columns: columns.flat_map(|column| column.iter().copied()).collect(),
        }
    }

    pub fn into_mat(self, what: &str, n_cols: usize) -> Result<Mat<f64>, ModelFileError> {
        let n_values = self.n_rows.checked_mul(self.n_cols);
        require(self.n_cols == n_cols, || {
            format!("{what} are {} × {}", self.n_rows, self.n_cols)
        })?;
        require_values(what, &self.columns, n_values.unwrap_or(usize::MAX))?;
        Ok(Mat::from_fn(self.n_rows, n_cols, |row, col| {
            self.columns[col * self.n_rows + row]
        }))
    }
}

impl TriangleRecord {
    pub fn of(matrix: MatRef<'_, f64>) -> Self {
        let packed = PackedLower::of(matrix);
        Self {
            order: packed.order(),
            columns: packed.columns().to_vec(),
        }
    }

    pub fn into_packed(self, what: &str, order: usize) -> Result<PackedLower, ModelFileError> {
        require(self.order == order, || {
            format!("{what} has order {}, not {order}", self.order)
        })?;
        let n_values = order
            .checked_mul(order + 1)
            .map_or(usize::MAX, |twice| twice / 2);
        require_values(what, &self.columns, n_values)?;
        let packed = PackedLower::from_columns(order, self.columns);
        require(packed.is_invertible(), || {
            format!("{what} has a zero on its diagonal")
        })?;
        Ok(packed)
    }
}

pub(crate) fn require(is_met: bool, what: impl FnOnce() -> String) -> Result<(), ModelFileError> {
    if is_met {
        return Ok(());
    }
    Err(ModelFileError::malformed(what()))
}

/// Fails unless there are `count` values, all finite.
pub(crate) fn require_values(
    what: &str,
    values: &[f64],
    count: usize,
) -> Result<(), ModelFileError> {
    require(values.len() == count, || {
        format!("{what}: {} values, not {count}", values.len())
    })?;
    require(values.iter().all(|value| value.is_finite()), || {
        format!("{what}: a value that is not finite")
    })
}

pub(crate) fn malformed(error: impl std::fmt::Display) -> ModelFileError {
    ModelFileError::malformed(error.to_string())
}
