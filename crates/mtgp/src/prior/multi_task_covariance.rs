//! The multi-task prior of eq. (16), as a covariance of rows (x, task).

use faer::{Mat, MatMut, MatRef};
use kernels::{Covariance, ParamLayout, TorqueCovariance};
use linalg::{Threads, column_mut, column_panels, for_each_column};

use crate::error::MtgpError;
use crate::prior::gradient::gram_sums;
use crate::prior::layout::{split, with_task};
use crate::prior::runs::{Runs, TaskTable};
use crate::prior::task_cov::TaskCovariance;
use crate::prior::task_matrix::TaskMatrix;

/// Columns that are worked on together: bounds the memory to (n, `PANEL`) a few times.
const PANEL: usize = 128;

/// The covariance between the torques of one joint at two inputs in two tasks.
///
/// ```text
/// c((x, γ), (x′, δ)) = (K^ρ)_γδ c^x(x, x′)
/// ```
/// θ is θ^x, the hyperparameters of c^x, followed by the free entries of Λ.
/// Being a covariance like any other, it serves the likelihoods, posteriors and
/// the search of `gp_core` as it is.
///
/// The likelihood knows the product only: (a² K^ρ, c^x/a²) is the same prior for
/// every a.
/// Nothing fixes a here; of two models, compare K^ρ c^x(x, x) or
/// [`TaskMatrix::correlations`].
///
/// T is what K^ρ is made of: [`TaskCovariance`], or other coordinates of the same matrix.
/// # Shapes
/// Rows have d + 1 columns, the covariates of c^x and the task: see
/// [`crate::Stacked`] and [`with_task`].
/// They may stand in any order, but sorted by task they are worked on faster.
/// # Panics
/// Every method that takes rows, if a task is not a whole number below m.
/// # Source
/// Eqs. (13)–(16), for one joint; Bonilla, Chai & Williams 2008, sec. 2.1.
#[derive(Debug, Clone, PartialEq)]
pub struct MultiTaskCovariance<T = TaskCovariance> {
    input: TorqueCovariance,
    task: T,
}

impl<T: TaskMatrix> MultiTaskCovariance<T> {
    /// The product of c^x = `input` and K^ρ = `task`.
    pub fn new(input: TorqueCovariance, task: T) -> Self {
        Self { input, task }
    }

    /// c^x, the covariance between inputs.
    pub fn input(&self) -> &TorqueCovariance {
        &self.input
    }

    /// K^ρ, the covariance between tasks.
    pub fn task(&self) -> &T {
        &self.task
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.task.n_tasks()
    }

    /// Inputs of one task as rows (x, task), checked.
    ///
    /// # Shapes
    /// `x` (k, d); the result (k, d + 1).
    /// # Errors
    /// [`MtgpError::UnknownTask`].
    pub fn rows_of(&self, x: MatRef<'_, f64>, task: usize) -> Result<Mat<f64>, MtgpError> {
        let n_tasks = self.n_tasks();
        if task >= n_tasks {
            let row = 0;
            return Err(MtgpError::UnknownTask { row, task, n_tasks });
        }
        Ok(with_task(x, task))
    }

    /// Adds c^x between rows `first..` and the columns of a panel that starts there.
    ///
    /// # Shapes
    /// `panel` (n − first, width), of which the diagonal block is filled below its
    /// diagonal only.
    fn add_input_panel(&self, x: MatRef<'_, f64>, first: usize, panel: MatMut<'_, f64>) {
        let width = panel.ncols();
        let (top, below) = panel.split_at_row_mut(width);
        let x_panel = x.subrows(first, width);
        self.input.add_gram(x_panel, top);
        if below.nrows() > 0 {
            let x_below = x.subrows(first + width, below.nrows());
            self.input.add_cross(x_below, x_panel, below);
        }
    }
}

/// First column and width of each panel of `n` columns.
fn panels(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n)
        .step_by(PANEL)
        .map(move |first| (first, PANEL.min(n - first)))
}

/// Memory for panels of n rows.
fn panel_memory(n_rows: usize, n_columns: usize) -> Mat<f64> {
    Mat::zeros(n_rows, PANEL.min(n_columns))
}

impl<T: TaskMatrix> Covariance for MultiTaskCovariance<T> {
    fn layout(&self) -> ParamLayout {
        self.input.layout().followed_by(self.task.layout())
    }

    fn params(&self) -> Vec<f64> {
        let mut theta = self.input.params();
        theta.extend(self.task.params());
        theta
    }

    fn set_params(&mut self, theta: &[f64]) {
        let (of_input, of_task) = theta.split_at(self.input.n_params());
        self.input.set_params(of_input);
        self.task.set_params(of_task);
    }

    fn n_params(&self) -> usize {
        self.input.n_params() + self.task.n_params()
    }

    fn revived(&self, x: MatRef<'_, f64>, amplitude: f64) -> Vec<f64> {
        let (x, _) = split(x, self.n_tasks());
        let k_task = self.task.k_task();
        let n_tasks = self.n_tasks();
        let mean_variance = (0..n_tasks).map(|i| k_task[(i, i)]).sum::<f64>() / n_tasks as f64;
        let mut theta = self.input.revived(x, amplitude / mean_variance.sqrt());
        theta.extend(self.task.params());
        theta
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        let (x, tasks) = split(x, self.n_tasks());
        let n = x.nrows();
        assert_eq!((out.nrows(), out.ncols()), (n, n));
        if self.task.is_one_function() {
            return self.input.add_gram(x, out);
        }
        let (k_task, runs) = (self.task.k_task(), Runs::new(&tasks));
        Threads::at_hand(n).for_each(column_panels(out, PANEL), |(first, mut out)| {
            let mut panel = Mat::zeros(n - first, out.ncols());
            self.add_input_panel(x, first, panel.as_mut());
            for k in 0..out.ncols() {
                let col = first + k;
                let target = &mut column_mut(&mut out, k)[col..];
                let values = &panel.col_as_slice(k)[k..];
                runs.add_weighted(col, k_task.col_as_slice(tasks[col]), values, target);
            }
        });
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        let (x1, tasks1) = split(x1, self.n_tasks());
        let (x2, tasks2) = split(x2, self.n_tasks());
        let (n1, n2) = (x1.nrows(), x2.nrows());
        assert_eq!((out.nrows(), out.ncols()), (n1, n2));
        if self.task.is_one_function() {
            return self.input.add_cross(x1, x2, out);
        }
        let (k_task, runs) = (self.task.k_task(), Runs::new(&tasks1));
        let mut memory = panel_memory(n1, n2);
        for (first, width) in panels(n2) {
            let mut panel = memory.as_mut().subcols_mut(0, width);
            panel.fill(0.0);
            let x_panel = x2.subrows(first, width);
            self.input.add_cross(x1, x_panel, panel.as_mut());
            for k in 0..width {
                let weights = k_task.col_as_slice(tasks2[first + k]);
                let target = column_mut(&mut out, first + k);
                runs.add_weighted(0, weights, column_mut(&mut panel, k), target);
            }
        }
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        let (x, tasks) = split(x, self.n_tasks());
        assert_eq!(out.len(), x.nrows());
        let k_task = self.task.k_task();
        let variances = self.input.diag(x);
        for ((value, task), variance) in out.iter_mut().zip(tasks).zip(variances) {
            *value += k_task[(task, task)] * variance;
        }
    }

    /// ```text
    /// θ^x: the adjoint of c^x for Q ∘ K^ρ          Λ: (T + Tᵀ)Λ
    /// T_γδ = Σ Q_ab c^x(x_a, x_b) over the samples a of task γ and b of task δ
    /// ```
    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        let (x, tasks) = split(x, self.n_tasks());
        let n = x.nrows();
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (n, n));
        assert_eq!(gradient.len(), self.n_params());
        if self.task.is_one_function() {
            return self.input.gram_adjoint(x, adjoint, gradient);
        }
        let k_task = self.task.k_task();
        let sums = gram_sums(&self.input, k_task.as_ref(), (x, &tasks), adjoint);
        let (of_input, of_task) = gradient.split_at_mut(self.input.n_params());
        for (slope, part) in of_input.iter_mut().zip(&sums.of_input) {
            *slope += part;
        }
        self.task.add_adjoint(sums.of_tasks.as_ref(), of_task);
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        let (x1, tasks1) = split(x1, self.n_tasks());
        let (x2, tasks2) = split(x2, self.n_tasks());
        let (n1, n2) = (x1.nrows(), x2.nrows());
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (n1, n2));
        assert_eq!(gradient.len(), self.n_params());
        if self.task.is_one_function() {
            return self.input.cross_adjoint(x1, x2, adjoint, gradient);
        }
        let (of_input, of_task) = gradient.split_at_mut(self.input.n_params());
        let (k_task, runs) = (self.task.k_task(), Runs::new(&tasks1));
        let mut table = TaskTable::new(self.n_tasks());
        let mut memory = panel_memory(n1, n2);
        for (first, width) in panels(n2) {
            let q = adjoint.subcols(first, width);
            let x_panel = x2.subrows(first, width);
            let mut panel = memory.as_mut().subcols_mut(0, width);

            panel.fill(0.0);
            for_each_column(q, |k, q| {
                let weights = k_task.col_as_slice(tasks2[first + k]);
                runs.add_weighted(0, weights, q, column_mut(&mut panel, k));
            });
            (self.input).cross_adjoint(x1, x_panel, panel.as_ref(), of_input);

            if !of_task.is_empty() {
                panel.fill(0.0);
                self.input.add_cross(x1, x_panel, panel.as_mut());
                for_each_column(q, |k, q| {
                    let values = column_mut(&mut panel, k);
                    table.add(&runs, 0, tasks2[first + k], q, values);
                });
            }
        }
        self.task.add_adjoint(table.sums(), of_task);
    }
}
