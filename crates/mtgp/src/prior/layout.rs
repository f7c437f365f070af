//! Samples of several tasks as rows (x, task): the only place that knows how a row is laid out.
//!
//! What the data call a *context* (a load) is a *task* here, numbered from zero.
//! A row holds the 3ℓ covariates and then, in its last column, the task.

use std::cmp::Ordering;

use faer::{Mat, MatRef};
use gp_core::evidence::spread_rows;

use crate::error::{MtgpError, require_count};

/// Samples of several tasks, sorted by task.
///
/// Samples of one task keep their order.
/// # Shapes
/// n samples of d = 3ℓ covariates, m tasks.
#[derive(Debug, Clone)]
pub struct Stacked {
    /// (n, d + 1), the task in the last column.
    inputs: Mat<f64>,
    /// Task of each row, ascending.
    tasks: Vec<usize>,
    /// Which of the samples given stands in each row.
    order: Vec<usize>,
    counts: Vec<usize>,
}

impl Stacked {
    /// Sorts samples by task.
    ///
    /// # Shapes
    /// `x` (n, d); `tasks` (n,), each below `n_tasks`.
    /// # Errors
    /// [`MtgpError::NoTasks`]; [`MtgpError::CountMismatch`] unless there is one task
    /// per row; [`MtgpError::UnknownTask`]; [`MtgpError::TaskWithoutSamples`];
    /// [`MtgpError::NonFinite`] for an input that is NaN or infinite.
    pub fn new(x: MatRef<'_, f64>, tasks: &[usize], n_tasks: usize) -> Result<Self, MtgpError> {
        let counts = counts(x, tasks, n_tasks)?;
        require_finite(x)?;
        let mut order: Vec<usize> = (0..tasks.len()).collect();
        order.sort_by_key(|&row| tasks[row]); // stable
        let d = x.ncols();
        let inputs = Mat::from_fn(order.len(), d + 1, |row, col| match order[row] {
            given if col == d => tasks[given] as f64,
            given => x[(given, col)],
        });
        Ok(Self {
            inputs,
            tasks: order.iter().map(|&given| tasks[given]).collect(),
            order,
            counts,
        })
    }

    /// The rows (x, task), sorted by task, (n, d + 1).
    pub fn inputs(&self) -> MatRef<'_, f64> {
        self.inputs.as_ref()
    }

    /// The covariates of the rows, (n, d).
    pub fn covariates(&self) -> MatRef<'_, f64> {
        self.inputs.subcols(0, self.inputs.ncols() - 1)
    }

    /// Task of each row, ascending, (n,).
    pub fn tasks(&self) -> &[usize] {
        &self.tasks
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.counts.len()
    }

    /// Number of samples of each task, (m,).
    pub fn counts(&self) -> &[usize] {
        &self.counts
    }

    /// Which of the samples given stands in each row, (n,).
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// Values in the order of the samples given, in the order of the rows.
    ///
    /// # Panics
    /// If there is not one value per sample.
    pub fn stack(&self, values: &[f64]) -> Vec<f64> {
        assert_eq!(values.len(), self.order.len(), "one value per sample");
        self.order.iter().map(|&given| values[given]).collect()
    }

    /// About `n_samples` of the samples, spread evenly over those of each task, and their rows.
    ///
    /// Of each task at least one.
    /// # Shapes
    /// m tasks as before; one row of this for each sample of the result.
    /// # Errors
    /// None for what was built by [`Stacked::new`].
    pub fn spread(&self, n_samples: usize) -> Result<(Self, Vec<usize>), MtgpError> {
        let n = self.tasks.len();
        let mut rows = Vec::new();
        let mut first = 0;
        for &count in &self.counts {
            let wanted = (count * n_samples).div_ceil(n).clamp(1, count);
            rows.extend(
                spread_rows(count, wanted)
                    .into_iter()
                    .map(|row| first + row),
            );
            first += count;
        }
        let x = self.covariates();
        let part = Mat::from_fn(rows.len(), x.ncols(), |row, col| x[(rows[row], col)]);
        let tasks: Vec<usize> = rows.iter().map(|&row| self.tasks[row]).collect();
        Ok((Self::new(part.as_ref(), &tasks, self.n_tasks())?, rows))
    }

    /// The distinct inputs over all tasks, and which of them each row has.
    ///
    /// Inputs are the same if all their covariates are equal as numbers.
    /// The distinct ones stand in the order of their first row.
    /// # Shapes
    /// (ν, d) for ν distinct inputs; (n,).
    pub fn unique_inputs(&self) -> (Mat<f64>, Vec<usize>) {
        let x = self.covariates();
        let mut sorted: Vec<usize> = (0..x.nrows()).collect();
        sorted.sort_by(|&a, &b| compare_rows(x, a, b)); // stable: first row of each kind first

        // The first row of the same kind.
        let mut representative = vec![0; x.nrows()];
        let mut first = 0;
        for (place, &row) in sorted.iter().enumerate() {
            if place == 0 || compare_rows(x, first, row) != Ordering::Equal {
                first = row;
            }
            representative[row] = first;
        }

        let mut number = vec![0; x.nrows()];
        let mut firsts = Vec::new();
        for (row, &first) in representative.iter().enumerate() {
            if first == row {
                number[row] = firsts.len();
                firsts.push(row);
            } else {
                number[row] = number[first];
            }
        }
        let distinct = Mat::from_fn(firsts.len(), x.ncols(), |row, col| x[(firsts[row], col)]);
        (distinct, number)
    }
}

/// Inputs of one task as rows (x, task), for predictions.
///
/// A task that a model does not have is found only when the model sees the rows,
/// and is then a panic; [`crate::MultiTaskCovariance::rows_of`] checks it.
/// # Shapes
/// `x` (k, d); the result (k, d + 1).
pub fn with_task(x: MatRef<'_, f64>, task: usize) -> Mat<f64> {
    let d = x.ncols();
    Mat::from_fn(x.nrows(), d + 1, |row, col| {
        if col == d { task as f64 } else { x[(row, col)] }
    })
}

/// Inputs of every task as rows (x, task), one task after the other.
///
/// # Shapes
/// `x` (k, d); the result (mk, d + 1).
pub(crate) fn with_every_task(x: MatRef<'_, f64>, n_tasks: usize) -> Mat<f64> {
    let (k, d) = (x.nrows(), x.ncols());
    Mat::from_fn(n_tasks * k, d + 1, |row, col| {
        if col == d {
            (row / k) as f64
        } else {
            x[(row % k, col)]
        }
    })
}

/// The two parts of rows (x, task): covariates, (n, d), and tasks, (n,).
///
/// # Panics
/// If the last column does not hold whole numbers below `n_tasks`.
pub fn split(rows: MatRef<'_, f64>, n_tasks: usize) -> (MatRef<'_, f64>, Vec<usize>) {
    assert!(rows.ncols() > 0, "a row holds the covariates and the task");
    let d = rows.ncols() - 1;
    let tasks = rows.col(d).iter().map(|&value| task_of(value, n_tasks));
    (rows.subcols(0, d), tasks.collect())
}

/// Whether the last column of rows holds whole numbers below `n_tasks`.
pub fn are_rows_of_tasks(rows: MatRef<'_, f64>, n_tasks: usize) -> bool {
    rows.ncols() > 0 && (rows.col(rows.ncols() - 1).iter()).all(|value| is_task(*value, n_tasks))
}

fn is_task(value: f64, n_tasks: usize) -> bool {
    value >= 0.0 && value < n_tasks as f64 && value.fract() == 0.0
}

/// The task that a number of the last column stands for.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "checked to be a whole number below a count"
)]
fn task_of(value: f64, n_tasks: usize) -> usize {
    assert!(
        is_task(value, n_tasks),
        "{value} is not one of {n_tasks} tasks"
    );
    value as usize
}

/// Number of samples of each task.
fn counts(x: MatRef<'_, f64>, tasks: &[usize], n_tasks: usize) -> Result<Vec<usize>, MtgpError> {
    if n_tasks == 0 {
        return Err(MtgpError::NoTasks);
    }
    require_count("tasks of samples", tasks.len(), x.nrows())?;
    let mut counts = vec![0; n_tasks];
    for (row, &task) in tasks.iter().enumerate() {
        match counts.get_mut(task) {
            Some(count) => *count += 1,
            None => return Err(MtgpError::UnknownTask { row, task, n_tasks }),
        }
    }
    match counts.iter().position(|&count| count == 0) {
        Some(task) => Err(MtgpError::TaskWithoutSamples { task, n_tasks }),
        None => Ok(counts),
    }
}

fn require_finite(x: MatRef<'_, f64>) -> Result<(), MtgpError> {
    for row in 0..x.nrows() {
        for column in 0..x.ncols() {
            let value = x[(row, column)];
            if !value.is_finite() {
                let what = "input";
                return Err(MtgpError::NonFinite {
                    what,
                    row,
                    column,
                    value,
                });
            }
        }
    }
    Ok(())
}

/// Lexicographic order of two rows, in which 0 and −0 are equal.
fn compare_rows(x: MatRef<'_, f64>, a: usize, b: usize) -> Ordering {
    (0..x.ncols())
        .map(|col| (x[(a, col)] + 0.0).total_cmp(&(x[(b, col)] + 0.0)))
        .find(|order| order.is_ne())
        .unwrap_or(Ordering::Equal)
}
