//! A watch over states outside the range of the training data, where a model extrapolates.

use faer::MatRef;
use torque_model::TrainingRanges;

use crate::messages;
use crate::number_column::NumberColumn;

/// Warns of states outside the training data; `columns` are the covariates' in their order.
///
/// # Panics
/// If `x`, (n, 3ℓ), does not have one column per covariate.
pub fn warn_outside(
    ranges: &TrainingRanges,
    x: MatRef<'_, f64>,
    file: &str,
    columns: &[NumberColumn],
) {
    let mut watch = RangeWatch::new(ranges);
    let mut state = vec![0.0; x.ncols()];
    for row in x.row_iter() {
        state
            .iter_mut()
            .zip(row.iter())
            .for_each(|(to, x)| *to = *x);
        watch.see(&state);
    }
    watch.warn(file, columns);
}

/// Counts of states outside the training data, in all and by covariate.
pub struct RangeWatch<'a> {
    ranges: &'a TrainingRanges,
    n_outside: Vec<u64>,
    n_rows_outside: u64,
    n_rows: u64,
}

impl<'a> RangeWatch<'a> {
    /// A watch that has seen nothing.
    pub fn new(ranges: &'a TrainingRanges) -> Self {
        Self {
            ranges,
            n_outside: vec![0; ranges.n_covariates()],
            n_rows_outside: 0,
            n_rows: 0,
        }
    }

    /// Looks at one state.
    ///
    /// # Panics
    /// If `x` does not have one entry per covariate.
    pub fn see(&mut self, x: &[f64]) {
        self.n_rows += 1;
        let mut is_outside = false;
        for covariate in self.ranges.outside(x) {
            self.n_outside[covariate] += 1;
            is_outside = true;
        }
        self.n_rows_outside += u64::from(is_outside);
    }

    /// Warns if a state was outside; `columns` are the covariates' in their order.
    pub fn warn(&self, file: &str, columns: &[NumberColumn]) {
        if self.n_rows_outside == 0 {
            return;
        }
        let by_column: Vec<String> = columns
            .iter()
            .zip(&self.n_outside)
            .filter(|(_, count)| **count > 0)
            .map(|(column, count)| format!("`{}` {count}", column.name))
            .collect();
        messages::warning(format!(
            "{file}: {} of {} rows lie outside the range of the training data, where the model extrapolates (rows by column: {})",
            self.n_rows_outside,
            self.n_rows,
            by_column.join(", ")
        ));
    }
}
