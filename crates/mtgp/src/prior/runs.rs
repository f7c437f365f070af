//! Work on a column of a matrix whose rows belong to tasks, one stretch of rows at a time.

use std::ops::Range;

use faer::{Mat, MatRef};
use linalg::sums::dot_in_lanes;

/// Stretches of consecutive rows of one task: m of them if the rows are sorted.
pub(crate) struct Runs {
    runs: Vec<(Range<usize>, usize)>,
}

impl Runs {
    /// The stretches of rows with the given tasks.
    pub fn new(tasks: &[usize]) -> Self {
        let mut start = 0;
        let runs = tasks.chunk_by(|a, b| a == b).map(|run| {
            let rows = start..start + run.len();
            start = rows.end;
            (rows, run[0])
        });
        Self {
            runs: runs.collect(),
        }
    }

    /// The stretches of the rows from `first` on, counted from there, with their tasks.
    fn from(&self, first: usize) -> impl Iterator<Item = (Range<usize>, usize)> {
        let skipped = self.runs.partition_point(|(rows, _)| rows.end <= first);
        self.runs[skipped..]
            .iter()
            .map(move |(rows, task)| (rows.start.max(first) - first..rows.end - first, *task))
    }

    /// target_a += weights_γ(a) values_a for the rows a from `first` on.
    pub fn add_weighted(&self, first: usize, weights: &[f64], values: &[f64], target: &mut [f64]) {
        for (rows, task) in self.from(first) {
            let weight = weights[task];
            for (target, value) in target[rows.clone()].iter_mut().zip(&values[rows]) {
                *target += weight * value;
            }
        }
    }
}

/// Sums of products over the blocks of a matrix that belong to two tasks.
pub(crate) struct TaskTable {
    sums: Mat<f64>, // (m, m)
}

impl TaskTable {
    /// All sums zero.
    pub fn new(n_tasks: usize) -> Self {
        Self {
            sums: Mat::zeros(n_tasks, n_tasks),
        }
    }

    /// T_γδ, (m, m).
    pub fn sums(&self) -> MatRef<'_, f64> {
        self.sums.as_ref()
    }

    /// Adds Σ_a q_a k_a to T_γ(a)δ over the rows a from `first` on of a column of task δ.
    pub fn add(&mut self, runs: &Runs, first: usize, task: usize, q: &[f64], k: &[f64]) {
        for (rows, row_task) in runs.from(first) {
            self.sums[(row_task, task)] += dot_in_lanes(&q[rows.clone()], &k[rows]);
        }
    }
}
