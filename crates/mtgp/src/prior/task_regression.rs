//! K^ρ as regressions of each task on the tasks before it: coordinates in which its posterior is nearly normal.

use faer::{Mat, MatRef};
use kernels::{ParamLayout, TorqueParams, Transform};

use crate::error::MtgpError;
use crate::prior::multi_task_covariance::MultiTaskCovariance;
use crate::prior::rank_part::pivoted_columns;
use crate::prior::task_cov::TaskFactor;
use crate::prior::task_matrix::{TaskMatrix, symmetric_weights};

/// Standard deviation of what is new in a task of which K^ρ has nothing new, relative to the first task.
const UNHEARD: f64 = 1e-8;

/// K^ρ of rank r by the regression of each task on up to r tasks before it, in a given order.
///
/// ```text
/// f_γ = Σ_{c < γ, c ≤ r} φ_γc f_c + s_γ e_γ,   e_γ independent of one another with covariance c^x
/// s_1 = 1,   s_γ > 0 for γ ≤ r,   s_γ = 0 beyond:   every further task is a combination of the first r
/// Λ_γ = Σ_{c < γ, c ≤ r} φ_γc Λ_c + s_γ ε_γᵀ,   K^ρ = ΛΛᵀ   (ε_γ the γ-th unit vector)
/// ```
/// It has r(2m + 1 − r)/2 − 1 free numbers, one fewer than Λ: s_1 = 1 makes c^x the covariance of the
/// first task, and leaves no a of (a² K^ρ, c^x/a²) open.
/// Columns of Λ have no sign that is open either.
/// What torques without much noise tell is φ, with little regard to s and θ^x: the torques of the later
/// tasks are those combinations, whatever process the first r are drawn from.
/// In entries of Λ the same knowledge is a narrow curved ridge, along which whole columns grow or turn.
/// # Source
/// Pourahmadi 1999, "Joint mean-covariance models with applications to longitudinal data": the
/// modified Cholesky decomposition; Petkos & Vijayakumar, whom the chapter compares itself with, regress
/// on learned contexts in the same way.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskRegression {
    /// Tasks in the order of the regressions.
    order: Vec<usize>,
    /// φ, (m, r), by place in the order; zero where c ≥ γ.
    coefficients: Mat<f64>,
    /// s of the first r tasks.
    stds: Vec<f64>,
}

impl TaskRegression {
    /// The regressions of K^ρ/a², and a², where the tasks stand in the order of a pivoted Cholesky factorisation.
    ///
    /// Each of the first r tasks is the one of which those before it tell least, and a² is the variance
    /// of the very first.
    /// # Shapes
    /// `k_task` K^ρ, (m, m), of which the lower triangle is read.
    /// # Errors
    /// [`MtgpError::NoTasks`], [`MtgpError::BadRank`].
    /// # Panics
    /// If `k_task` is not square.
    pub fn of(k_task: MatRef<'_, f64>, rank: usize) -> Result<(Self, f64), MtgpError> {
        let n_tasks = k_task.nrows();
        assert_eq!(n_tasks, k_task.ncols());
        if rank == 0 || rank > n_tasks {
            return Err(MtgpError::BadRank { rank, n_tasks });
        }
        let (columns, mut order) = pivoted_columns(k_task, rank);
        for task in 0..n_tasks {
            if !order.contains(&task) {
                order.push(task);
            }
        }
        let lambda = |place: usize, col: usize| columns[(order[place], col)];
        let first = lambda(0, 0);
        let mut coefficients = Mat::zeros(n_tasks, rank);
        for place in 1..n_tasks {
            // φ_γ Λ_pp = Λ_γ with the triangular Λ_pp of the tasks before, from the last column on.
            for col in (0..rank.min(place)).rev() {
                let later: f64 = (col + 1..rank.min(place))
                    .map(|c| coefficients[(place, c)] * lambda(c, col))
                    .sum();
                if lambda(col, col) > 0.0 {
                    coefficients[(place, col)] = (lambda(place, col) - later) / lambda(col, col);
                }
            }
        }
        let stds = (0..rank).map(|c| (lambda(c, c) / first).max(UNHEARD));
        let stds = stds.collect();
        let regression = Self {
            order,
            coefficients,
            stds,
        };
        Ok((regression, first * first))
    }

    /// Rank r of K^ρ.
    pub fn rank(&self) -> usize {
        self.stds.len()
    }

    /// Tasks in the order of the regressions, (m,).
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// Λ with its rows in the order of the regressions, (m, r), lower triangular.
    fn ordered_factor(&self) -> Mat<f64> {
        let mut lambda: Mat<f64> = Mat::zeros(self.n_tasks(), self.rank());
        for (place, std) in self.stds.iter().enumerate() {
            lambda[(place, place)] = *std;
        }
        for (place, col) in self.places() {
            for before in 0..=col {
                let value = self.coefficients[(place, col)] * lambda[(col, before)];
                lambda[(place, before)] += value;
            }
        }
        lambda
    }

    /// Λ with K^ρ = ΛΛᵀ, (m, r), its rows in the order of the tasks and so not triangular.
    pub fn root(&self) -> Mat<f64> {
        self.in_order_of_tasks(self.ordered_factor().as_ref())
    }

    /// Rows in the order of the regressions as rows in that of the tasks, (m, r).
    fn in_order_of_tasks(&self, ordered: MatRef<'_, f64>) -> Mat<f64> {
        let mut root = Mat::zeros(self.n_tasks(), self.rank());
        for (place, task) in self.order.iter().enumerate() {
            root.row_mut(*task).copy_from(ordered.row(place));
        }
        root
    }

    /// Places (γ, c) of the coefficients in the order of the regressions, row by row.
    fn places(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let rank = self.rank();
        (1..self.n_tasks()).flat_map(move |row| (0..rank.min(row)).map(move |col| (row, col)))
    }
}

/// The numbers are s_2 to s_r and then the coefficients φ, row by row.
impl TaskMatrix for TaskRegression {
    fn n_tasks(&self) -> usize {
        self.order.len()
    }

    fn k_task(&self) -> Mat<f64> {
        let root = self.root();
        &root * root.transpose()
    }

    /// Names `task_std[c]` of s_2 to s_r and `task_regression[γ,δ]` of the regression of task γ on task δ.
    fn layout(&self) -> ParamLayout {
        let tasks = self
            .places()
            .map(|(row, col)| (self.order[row], self.order[col]));
        ParamLayout::new()
            .with_vector("task_std", self.rank() - 1, Transform::Positive)
            .with_entries("task_regression", tasks, Transform::Free { scale: 1.0 })
    }

    fn n_params(&self) -> usize {
        TaskFactor::count(self.n_tasks(), self.rank()) - 1
    }

    fn params(&self) -> Vec<f64> {
        let mut params = self.stds[1..].to_vec();
        params.extend(self.places().map(|place| self.coefficients[place]));
        params
    }

    fn set_params(&mut self, params: &[f64]) {
        assert_eq!(params.len(), self.n_params());
        let (stds, coefficients) = params.split_at(self.rank() - 1);
        self.stds[1..].copy_from_slice(stds);
        for (place, value) in self.places().zip(coefficients) {
            self.coefficients[place] = *value;
        }
    }

    /// From the last task to the first: ∂/∂φ_γc = g_γ·Λ_c, which also adds φ_γc g_γ to g_c, and
    /// ∂/∂s_γ = g_γγ, where g = (T + Tᵀ)Λ.
    fn add_adjoint(&self, weights: MatRef<'_, f64>, gradient: &mut [f64]) {
        let symmetric = symmetric_weights(self, weights, gradient);
        let lambda = self.ordered_factor();
        let unordered = symmetric * self.in_order_of_tasks(lambda.as_ref());
        let mut slopes = Mat::from_fn(self.n_tasks(), self.rank(), |place, col| {
            unordered[(self.order[place], col)]
        });
        let (of_stds, of_coefficients) = gradient.split_at_mut(self.rank() - 1);
        let places: Vec<(usize, usize)> = self.places().collect();
        for (slope, (row, col)) in of_coefficients.iter_mut().zip(places).rev() {
            for before in 0..=col {
                *slope += slopes[(row, before)] * lambda[(col, before)];
            }
            for before in 0..self.rank() {
                let passed = self.coefficients[(row, col)] * slopes[(row, before)];
                slopes[(col, before)] += passed;
            }
        }
        for (idx, slope) in of_stds.iter_mut().enumerate() {
            *slope += slopes[(idx + 1, idx + 1)];
        }
    }
}

impl MultiTaskCovariance {
    /// The same prior with K^ρ as regressions, whose first task has the covariance c^x.
    ///
    /// # Errors
    /// [`MtgpError::Kernel`] if K^ρ is zero.
    pub fn with_regression(&self) -> Result<MultiTaskCovariance<TaskRegression>, MtgpError> {
        let task = self.task();
        let (regression, variance) = TaskRegression::of(task.k_task().as_ref(), task.rank())?;
        let a = variance.sqrt();
        let times_a = |values: Vec<f64>| values.into_iter().map(|value| a * value).collect();
        let params = self.input().named_params();
        let input = self.input().with_params(TorqueParams {
            bias_std: a * params.bias_std,
            linear_std: times_a(params.linear_std),
            signal_std: a * params.signal_std,
            length_scales: params.length_scales,
            coulomb_std: params.coulomb_std.map(times_a),
        })?;
        Ok(MultiTaskCovariance::new(input, regression))
    }
}
