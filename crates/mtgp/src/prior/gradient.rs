//! The gradient of a weighted sum of covariances between samples of several tasks, two tasks at a time.
//!
//! Between samples of two given tasks K^ρ is a number, so that
//!
//! ```text
//! S = Σ_ab Q_ab (K^ρ)_γ(a)δ(b) c^x(x_a, x_b) = Σ_γδ (K^ρ)_γδ T_γδ      T_γδ = Σ_{a∈γ, b∈δ} Q_ab c^x(x_a, x_b)
//! ∂S/∂θ^x = Σ_γδ (K^ρ)_γδ ∂T_γδ/∂θ^x
//! ```
//! T_γδ follows from its own gradient by Euler's theorem, so that c^x is computed once for both:
//! see [`TorqueCovariance::sum_of_its_gradient`].

use std::ops::Range;

use faer::{Mat, MatRef};
use kernels::{Covariance, TorqueCovariance};
use linalg::{Threads, for_each_column};

use crate::prior::runs::{Runs, TaskTable};

/// Samples of one task that are worked on together.
///
/// Few enough that a pair of such stretches is done by one thread.
const LONGEST: usize = 256;

/// Mean number of samples of a task below which a pair of tasks is too little work for its own gradient.
const FEW: usize = 64;

/// ∂S/∂θ^x, and T, in whose entries the gradient of S with respect to K^ρ is had.
pub(crate) struct PairSums {
    /// One entry per hyperparameter of c^x.
    pub of_input: Vec<f64>,
    /// T, (m, m), with all of T_γδ + T_δγ in one of the two places.
    pub of_tasks: Mat<f64>,
}

/// Some samples of one task.
struct Stretch {
    task: usize,
    /// Rows of the data, ascending.
    rows: Vec<usize>,
    /// Inputs of these rows, (k, d).
    x: Mat<f64>,
}

impl Stretch {
    /// The samples with the given tasks, in stretches by ascending task.
    fn of(x: MatRef<'_, f64>, tasks: &[usize]) -> Vec<Self> {
        let mut order: Vec<usize> = (0..tasks.len()).collect();
        order.sort_by_key(|&row| tasks[row]); // stable
        let of_one_task = order.chunk_by(|&a, &b| tasks[a] == tasks[b]);
        let stretches = of_one_task.flat_map(|rows| rows.chunks(LONGEST));
        let stretch = |rows: &[usize]| Self {
            task: tasks[rows[0]],
            rows: rows.to_vec(),
            x: Mat::from_fn(rows.len(), x.ncols(), |row, col| x[(rows[row], col)]),
        };
        stretches.map(stretch).collect()
    }

    /// The rows, if they follow each other.
    fn range(&self) -> Option<Range<usize>> {
        let (first, last) = (self.rows[0], self.rows[self.rows.len() - 1]);
        (last - first + 1 == self.rows.len()).then_some(first..last + 1)
    }
}

/// The sums over all pairs of samples, from the lower triangle of a symmetric Q.
///
/// Every stretch with those before it is a part of its own, which threads share.
/// # Shapes
/// `k_task` K^ρ, (m, m); `x` (n, d); `tasks` (n,); `adjoint` Q, (n, n).
pub(crate) fn gram_sums(
    input: &TorqueCovariance,
    k_task: MatRef<'_, f64>,
    (x, tasks): (MatRef<'_, f64>, &[usize]),
    adjoint: MatRef<'_, f64>,
) -> PairSums {
    if tasks.len() < FEW * k_task.nrows() {
        return PairSums::of_whole(input, k_task, (x, tasks), adjoint);
    }
    let stretches = Stretch::of(x, tasks);
    let parts = Threads::at_hand(tasks.len()).map((0..stretches.len()).collect(), |idx| {
        let mut part = PairSums::zeros(input, k_task);
        let stretch = &stretches[idx];
        for earlier in &stretches[..idx] {
            // What is below the diagonal stands for both triangles.
            part.add(input, k_task, (stretch, earlier), 2.0, |gradient| {
                with_lower_block(adjoint, stretch, earlier, |q| {
                    input.cross_adjoint(stretch.x.as_ref(), earlier.x.as_ref(), q, gradient);
                });
            });
        }
        part.add(input, k_task, (stretch, stretch), 1.0, |gradient| {
            with_lower_block(adjoint, stretch, stretch, |q| {
                input.gram_adjoint(stretch.x.as_ref(), q, gradient);
            });
        });
        part
    });
    PairSums::total(input, k_task, &parts)
}

impl PairSums {
    /// The sums by their definitions, with two matrices of the size of Q: c^x is computed twice, but all at once.
    fn of_whole(
        input: &TorqueCovariance,
        k_task: MatRef<'_, f64>,
        (x, tasks): (MatRef<'_, f64>, &[usize]),
        adjoint: MatRef<'_, f64>,
    ) -> Self {
        let n = tasks.len();
        let runs = Runs::new(tasks);
        let mut of_input = vec![0.0; input.n_params()];
        let mut weighted = Mat::zeros(n, n); // Q ∘ K^ρ
        for_each_column(adjoint, |col, q| {
            let weights = k_task.col(tasks[col]).try_as_col_major();
            let weights = weights.expect("columns of a Mat are contiguous").as_slice();
            let target = &mut weighted.col_as_slice_mut(col)[col..];
            runs.add_weighted(col, weights, &q[col..], target);
        });
        input.gram_adjoint(x, weighted.as_ref(), &mut of_input);

        weighted.fill(0.0);
        input.add_gram(x, weighted.as_mut());
        let mut table = TaskTable::new(k_task.nrows());
        for_each_column(adjoint, |col, q| {
            let values = weighted.col_as_slice_mut(col);
            // What is below the diagonal stands for both triangles.
            values[col] *= 0.5;
            table.add(&runs, col, tasks[col], &q[col..], &values[col..]);
        });
        Self {
            of_input,
            of_tasks: table.sums() * 2.0,
        }
    }

    fn zeros(input: &TorqueCovariance, k_task: MatRef<'_, f64>) -> Self {
        Self {
            of_input: vec![0.0; input.n_params()],
            of_tasks: Mat::zeros(k_task.nrows(), k_task.ncols()),
        }
    }

    /// Adds `factor` times the sum over two stretches, of which `add_gradient` adds the gradient for K^ρ = 1.
    fn add(
        &mut self,
        input: &TorqueCovariance,
        k_task: MatRef<'_, f64>,
        (first, second): (&Stretch, &Stretch),
        factor: f64,
        add_gradient: impl FnOnce(&mut [f64]),
    ) {
        let mut gradient = vec![0.0; self.of_input.len()];
        add_gradient(&mut gradient);
        let tasks = (first.task, second.task);
        for (total, slope) in self.of_input.iter_mut().zip(&gradient) {
            *total += factor * k_task[tasks] * slope;
        }
        self.of_tasks[tasks] += factor * input.sum_of_its_gradient(&gradient);
    }

    /// The sum of all parts, in their order.
    fn total(input: &TorqueCovariance, k_task: MatRef<'_, f64>, parts: &[Self]) -> Self {
        let mut total = Self::zeros(input, k_task);
        for part in parts {
            for (total, slope) in total.of_input.iter_mut().zip(&part.of_input) {
                *total += slope;
            }
            total.of_tasks += &part.of_tasks;
        }
        total
    }
}

/// Hands the block of Q between two stretches on; where they are the same, its lower triangle.
///
/// Only the lower triangle of Q is read; rows that do not follow each other are copied.
fn with_lower_block(
    adjoint: MatRef<'_, f64>,
    first: &Stretch,
    second: &Stretch,
    work: impl FnOnce(MatRef<'_, f64>),
) {
    if let (Some(rows), Some(columns)) = (first.range(), second.range())
        && (rows.start >= columns.end || rows == columns)
    {
        return work(adjoint.submatrix(rows.start, columns.start, rows.len(), columns.len()));
    }
    let block = Mat::from_fn(first.rows.len(), second.rows.len(), |row, col| {
        let (a, b) = (first.rows[row], second.rows[col]);
        adjoint[(a.max(b), a.min(b))]
    });
    work(block.as_ref());
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::task_cov::{TaskCovariance, TaskFactor};
    use crate::prior::task_matrix::TaskMatrix;
    use kernels::TorqueForm;

    const N: usize = 650;
    const M: usize = 2;

    fn wave(row: usize, col: usize) -> f64 {
        (0.37 * row as f64 + 1.3 * col as f64).sin()
    }

    /// More samples of a task than a stretch holds, sorted and mixed.
    #[test]
    fn sums_are_those_of_whole_matrices_and_the_upper_triangle_is_not_read() {
        let x = Mat::from_fn(N, 3, wave);
        let input = TorqueCovariance::unit(1, TorqueForm::Coulomb);
        let factor = TaskFactor::from_entries(M, 2, &[0.8, -0.4, 1.1]).unwrap();
        let k_task = TaskCovariance::Factor(factor).k_task();
        let q = |a: usize, b: usize| wave(a.max(b), 7 + a.min(b)) / N as f64;
        let lower = Mat::from_fn(N, N, |a, b| if a >= b { q(a, b) } else { f64::NAN });
        let sorted: Vec<usize> = (0..N).map(|row| usize::from(row > 300)).collect();
        let backwards: Vec<usize> = sorted.iter().map(|task| 1 - task).collect();
        let mixed: Vec<usize> = (0..N).map(|row| (row / 3) % M).collect();
        for tasks in [sorted, backwards, mixed] {
            let (data, k_task) = ((x.as_ref(), tasks.as_slice()), k_task.as_ref());
            let both = [
                gram_sums(&input, k_task, data, lower.as_ref()),
                PairSums::of_whole(&input, k_task, data, lower.as_ref()),
            ];

            let k_x = input.gram(x.as_ref());
            let mut of_tasks = Mat::<f64>::zeros(M, M);
            let mut weighted = Mat::<f64>::zeros(N, N);
            for a in 0..N {
                for b in 0..N {
                    of_tasks[(tasks[a], tasks[b])] += q(a, b) * k_x[(a, b)];
                    weighted[(a, b)] = q(a, b) * k_task[(tasks[a], tasks[b])];
                }
            }
            let mut of_input = vec![0.0; input.n_params()];
            input.gram_adjoint(x.as_ref(), weighted.as_ref(), &mut of_input);

            // N² terms of size 4/N, rounded at random.
            let tolerance = 64.0 * f64::EPSILON * 4.0 * N as f64;
            let symmetric = |m: &Mat<f64>, a: usize, b: usize| m[(a, b)] + m[(b, a)];
            for sums in both {
                for (a, b) in [(0, 0), (0, 1), (1, 1)] {
                    let (found, expected) =
                        (symmetric(&sums.of_tasks, a, b), symmetric(&of_tasks, a, b));
                    assert!((found - expected).abs() <= tolerance, "{found} {expected}");
                }
                for (found, expected) in sums.of_input.iter().zip(&of_input) {
                    assert!((found - expected).abs() <= tolerance, "{found} {expected}");
                }
            }
        }
    }
}
