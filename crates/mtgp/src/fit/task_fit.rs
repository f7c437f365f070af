//! A joint's torque under several loads, learned.

use faer::{Mat, MatRef};
use gp_core::search::{Distance, FitReport, Found, Start};
use gp_core::{Fit, GpError, LikelihoodOptions, Posterior, Prediction};

use crate::error::MtgpError;
use crate::latent::predict_mean_of_all_tasks;
use crate::prior::MultiTaskCovariance;
use crate::prior::Stacked;
use crate::prior::TaskMatrix;
use crate::prior::{TaskCovariance, TaskFactor};

/// A joint's torque in every task, learned.
#[derive(Debug, Clone)]
pub struct TaskFit {
    /// The process with the hyperparameters found, conditioned on the data.
    pub posterior: Posterior<MultiTaskCovariance>,
    /// How the hyperparameters were found: the searches on all samples.
    pub report: FitReport,
}

impl TaskFit {
    /// Conditions on the data with the hyperparameters that a search found.
    pub(super) fn new(
        data: &Stacked,
        targets: &[f64],
        mut found: Found<MultiTaskCovariance>,
        likelihood: LikelihoodOptions,
    ) -> Result<Self, MtgpError> {
        found.stages.drain(..found.stages.len().saturating_sub(1));
        let Fit { posterior, report } = Fit::new(found, data.inputs(), targets, likelihood)?;
        Ok(Self { posterior, report })
    }

    /// Where a search on other data, or of several joints, may set out.
    pub fn start(&self) -> Start<MultiTaskCovariance> {
        Start::given(self.covariance().clone(), self.noise_std()).at(Distance::Near)
    }

    /// The covariance with the hyperparameters found.
    pub fn covariance(&self) -> &MultiTaskCovariance {
        self.posterior.covariance()
    }

    /// The noise standard deviation found, in target units.
    pub fn noise_std(&self) -> f64 {
        self.posterior.noise_std()
    }

    /// Log marginal likelihood, natural log, summed over the data.
    pub fn log_marginal(&self) -> f64 {
        self.report.log_marginal
    }

    /// K^ρ, (m, m).
    pub fn k_task(&self) -> Mat<f64> {
        self.covariance().task().k_task()
    }

    /// Λ, (m, r); `None` where K^ρ is fixed.
    pub fn lambda(&self) -> Option<MatRef<'_, f64>> {
        self.task_factor().map(TaskFactor::lambda)
    }

    pub(crate) fn task_factor(&self) -> Option<&TaskFactor> {
        match self.covariance().task() {
            TaskCovariance::Factor(factor) => Some(factor),
            _ => None,
        }
    }

    /// Posterior means and latent variances of one task.
    ///
    /// # Shapes
    /// `x` (k, 3ℓ).
    /// # Errors
    /// [`MtgpError::UnknownTask`]; [`MtgpError::Gp`] for inputs that are not finite or
    /// have another number of columns.
    pub fn predict(&self, task: usize, x: MatRef<'_, f64>) -> Result<Prediction, MtgpError> {
        let rows = self.rows_of(task, x)?;
        Ok(self.posterior.predict(rows.as_ref())?)
    }

    /// Posterior means of one task, in target units.
    ///
    /// # Errors
    /// As for [`TaskFit::predict`].
    pub fn predict_mean(&self, task: usize, x: MatRef<'_, f64>) -> Result<Vec<f64>, MtgpError> {
        let rows = self.rows_of(task, x)?;
        Ok(self.posterior.predict_mean(rows.as_ref())?)
    }

    /// Posterior means of every task at the rows of `x`, in target units, (k, m): see
    /// [`predict_mean_of_all_tasks`].
    ///
    /// # Errors
    /// As there.
    pub fn predict_mean_of_all_tasks(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, MtgpError> {
        predict_mean_of_all_tasks(&self.posterior, x)
    }

    fn rows_of(&self, task: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, MtgpError> {
        let expected = 3 * self.covariance().input().n_joints();
        if x.ncols() != expected {
            let found = x.ncols();
            return Err(GpError::WrongCovariates { found, expected }.into());
        }
        self.covariance().rows_of(x, task)
    }
}
