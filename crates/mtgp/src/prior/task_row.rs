//! One task as a mixture of the latent functions: a row of Λ, with a part of its own beyond them.

use faer::Mat;

use crate::error::{MtgpError, require_count};
use crate::prior::rank_part::pivoted_columns;
use crate::prior::task_cov::{TaskCovariance, TaskFactor, lower_trapezoidal};
use crate::prior::task_matrix::TaskMatrix;

/// How the torque of a task is made of the r latent functions f_c, and of one of its own.
///
/// ```text
/// τ(x) = Σ_c λ_c f_c(x) + s g(x),   f_c, g independent with covariance c^x
/// ```
/// Its covariance with task γ is λᵀΛ_γ c^x, its own (λᵀλ + s²) c^x.
/// # Source
/// Eq. (16) with K^ρ = ΛΛᵀ, grown by one row and column as section 5 asks for.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskRow {
    /// λ, (r,).
    pub entries: Vec<f64>,
    /// s: zero for a task in the span of the latent functions.
    pub own_std: f64,
}

impl TaskRow {
    /// A task in the span of the latent functions.
    pub fn in_span(entries: Vec<f64>) -> Self {
        Self {
            entries,
            own_std: 0.0,
        }
    }

    /// Fails unless there are r finite entries and a finite s.
    pub(crate) fn require(&self, rank: usize) -> Result<(), MtgpError> {
        require_count("entries of a task's row", self.entries.len(), rank)?;
        let mut values = self.entries.iter().chain([&self.own_std]).enumerate();
        match values.find(|(_, value)| !value.is_finite()) {
            None => Ok(()),
            Some((column, &value)) => Err(MtgpError::NonFinite {
                what: "task_row",
                row: 0,
                column,
                value,
            }),
        }
    }

    /// λᵀμ for another row μ.
    pub(crate) fn dot(&self, entries: &[f64]) -> f64 {
        let products = self.entries.iter().zip(entries);
        products.map(|(a, b)| a * b).sum()
    }
}

impl TaskCovariance {
    /// A Λ with ΛΛᵀ = K^ρ, (m, r): that of the factor, I, a column of ones, or the Cholesky factor of described tasks.
    pub fn root(&self) -> Mat<f64> {
        match self {
            Self::Identity { n_tasks } => Mat::identity(*n_tasks, *n_tasks),
            Self::Ones { n_tasks } => Mat::full(*n_tasks, 1, 1.0),
            Self::Factor(factor) => factor.lambda().to_owned(),
            Self::Described(tasks) => {
                let k_task = tasks.k_task();
                let (root, _) = pivoted_columns(k_task.as_ref(), tasks.n_tasks());
                lower_trapezoidal(root.as_ref())
            }
        }
    }

    /// K^ρ with one more task of which the descriptors are known; `None` where K^ρ is not by descriptors.
    ///
    /// # Errors
    /// As for [`crate::prior::DescribedTasks::with_task`].
    pub fn with_described(&self, descriptor: &[f64]) -> Option<Result<Self, MtgpError>> {
        match self {
            Self::Described(tasks) => Some(tasks.with_task(descriptor).map(Self::Described)),
            Self::Identity { .. } | Self::Ones { .. } | Self::Factor(_) => None,
        }
    }

    /// K^ρ with one more task of a given row, of the same rank: Λ grows by the row.
    ///
    /// Its other entries keep every bit, or where tasks are described their value to rounding; descriptors are then
    /// forgotten.
    /// # Errors
    /// [`MtgpError::CountMismatch`] or [`MtgpError::NonFinite`] unless the row has r finite entries;
    /// [`MtgpError::CountMismatch`] if it has a variance of its own, for which Λ has no column.
    /// # Source
    /// Section 5: K^ρ grows by one row and column.
    pub fn with_row(&self, row: &TaskRow) -> Result<Self, MtgpError> {
        let root = self.root();
        row.require(root.ncols())?;
        if row.own_std != 0.0 {
            require_count("columns of task_factor", root.ncols() + 1, root.ncols())?;
        }
        let m = root.nrows();
        let grown = Mat::from_fn(m + 1, root.ncols(), |task, c| {
            if task < m {
                root[(task, c)]
            } else {
                row.entries[c]
            }
        });
        Ok(Self::Factor(TaskFactor::new(grown)?))
    }

    /// The rows of [`TaskCovariance::root`], one per task.
    pub fn rows(&self) -> Vec<TaskRow> {
        let root = self.root();
        let row = |task| root.row(task).iter().copied().collect();
        (0..root.nrows())
            .map(|task| TaskRow::in_span(row(task)))
            .collect()
    }
}
