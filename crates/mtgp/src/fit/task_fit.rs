//! A joint's torque under several loads, learned: result and report.

use faer::{Mat, MatRef};
use gp_core::{FitPosterior, GpError, LikelihoodOptions, MethodUsed, Prediction};

use super::climb::Climb;
use super::options::{Origin, TaskStart};
use crate::error::MtgpError;
use crate::layout::Stacked;
use crate::prior::MultiTaskCovariance;
use crate::task_cov::{TaskCovariance, TaskFactor};

/// How a fit was found and what help it needed.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskFitReport {
    /// Log marginal likelihood of the fit, natural log, summed over the data.
    pub log_marginal: f64,
    /// Every start, in the order tried.
    pub starts: Vec<TaskStart>,
    /// Index in `starts` of the one that won.
    pub winner: usize,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// How the matrix of the fit was factorised.
    pub method: MethodUsed,
    /// Rank of that factor: the number of samples if dense.
    pub factor_rank: usize,
    /// Bound on the error of the log marginal likelihood at the hyperparameters found, in nats.
    pub error_bound: f64,
    /// A lower bound on the condition number of K + σ²I.
    pub condition_lower_bound: f64,
}

impl TaskFitReport {
    /// The start that won.
    pub fn winning_start(&self) -> &TaskStart {
        &self.starts[self.winner]
    }

    /// Where the start that won is from.
    pub fn origin(&self) -> Origin {
        self.winning_start().origin
    }

    /// Evaluations of all starts together.
    pub fn evaluations(&self) -> usize {
        self.starts
            .iter()
            .map(|start| start.report.evaluations)
            .sum()
    }
}

/// A joint's torque in every task, learned.
#[derive(Debug, Clone)]
pub struct TaskFit {
    /// The process with the hyperparameters found, conditioned on the data.
    pub posterior: FitPosterior<MultiTaskCovariance>,
    /// How the hyperparameters were found.
    pub report: TaskFitReport,
}

impl TaskFit {
    /// Conditions on the data at the end of a search.
    pub(crate) fn new(
        data: &Stacked,
        targets: &[f64],
        climb: Climb<MultiTaskCovariance>,
        likelihood: LikelihoodOptions,
    ) -> Result<Self, MtgpError> {
        let (posterior, error_bound) = FitPosterior::with_error_bound(
            climb.covariance,
            climb.noise_std,
            data.inputs(),
            targets,
            likelihood,
        )?;
        let report = TaskFitReport {
            log_marginal: climb.starts[climb.winner].report.log_marginal,
            starts: climb.starts,
            winner: climb.winner,
            bounds_hit: climb.bounds_hit,
            method: posterior.method(),
            factor_rank: posterior.rank(),
            error_bound,
            condition_lower_bound: posterior.condition_lower_bound(),
        };
        Ok(Self { posterior, report })
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

    pub(crate) fn rows_of(&self, task: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, MtgpError> {
        let expected = self.covariance().input().linear().linear_std().len();
        if x.ncols() != expected {
            let found = x.ncols();
            return Err(GpError::WrongCovariates { found, expected }.into());
        }
        self.covariance().rows_of(x, task)
    }
}
