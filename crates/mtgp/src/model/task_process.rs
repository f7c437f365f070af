//! The process of one joint's torque in every context, with the summary of its fit.

use faer::{Mat, MatRef};
use gp_core::{FitPosterior, FitSummary, Prediction, ProcessPredictor, Scaling};

use crate::error::MtgpError;
use crate::prior::{MultiTaskCovariance, TaskCovariance, TaskMatrix, TaskRow, split};
use crate::task_fit::{Origin, TaskFit, TaskFitReport};

/// A multi-task process over one joint's torque, with the summary of its fit.
#[derive(Debug, Clone)]
pub struct TaskProcess {
    /// The process, conditioned on the data of all contexts.
    pub posterior: FitPosterior<MultiTaskCovariance>,
    /// How its hyperparameters were found.
    pub summary: FitSummary,
}

impl TaskProcess {
    /// A posterior with the hyperparameters that a search found, and the summary of its report.
    pub fn new(posterior: FitPosterior<MultiTaskCovariance>, report: &TaskFitReport) -> Self {
        Self {
            posterior,
            summary: FitSummary {
                log_marginal: report.log_marginal,
                start: origin_name(report.origin()),
                n_starts: report.starts.len(),
                evaluations: report.evaluations(),
                bounds_hit: report.bounds_hit.clone(),
                condition_lower_bound: report.condition_lower_bound,
                method: report.method.to_string(),
                rank: report.factor_rank,
                error_bound: Some(report.error_bound),
            },
        }
    }

    /// The chapter's name of the model: iGP, pGP, or mGP with its rank.
    pub fn name(&self) -> String {
        match self.covariance().task() {
            TaskCovariance::Identity { .. } => "iGP".to_owned(),
            TaskCovariance::Ones { .. } => "pGP".to_owned(),
            TaskCovariance::Factor(factor) => format!("mGP-{}", factor.rank()),
        }
    }

    /// The prior with its hyperparameters.
    pub fn covariance(&self) -> &MultiTaskCovariance {
        self.posterior.covariance()
    }

    /// Number of joints ℓ of the robot it predicts for.
    pub fn n_joints(&self) -> usize {
        self.covariance().input().n_joints()
    }

    /// Variance of the noise of an observation, in squared target units.
    pub fn noise_var(&self) -> f64 {
        self.posterior.noise_std().powi(2)
    }

    /// The process with one more task of a given row; nothing else changes.
    ///
    /// # Errors
    /// As for [`TaskCovariance::with_row`].
    pub(crate) fn with_row(&self, row: &TaskRow) -> Result<Self, MtgpError> {
        let prior = self.covariance();
        let task = prior.task().with_row(row)?;
        let grown = MultiTaskCovariance::new(prior.input().clone(), task);
        Ok(Self {
            posterior: self.posterior.with_covariance(grown),
            summary: self.summary.clone(),
        })
    }

    /// The process conditioned on further torques of a task, with the same hyperparameters.
    ///
    /// # Shapes
    /// `x` (k, 3ℓ); `torques` (k,), N·m.
    /// # Errors
    /// As for [`MultiTaskCovariance::rows_of`] and [`FitPosterior::with_samples`].
    pub(crate) fn with_samples(
        &self,
        task: usize,
        x: MatRef<'_, f64>,
        torques: &[f64],
    ) -> Result<Self, MtgpError> {
        let rows = self.covariance().rows_of(x, task)?;
        let posterior = self.posterior.with_samples(rows.as_ref(), torques)?;
        let summary = FitSummary {
            rank: posterior.rank(),
            condition_lower_bound: posterior.condition_lower_bound(),
            ..self.summary.clone()
        };
        Ok(Self { posterior, summary })
    }

    /// Posterior means and latent variances of one task, counted from zero.
    ///
    /// # Shapes
    /// `x` (k, 3ℓ).
    /// # Errors
    /// [`MtgpError::UnknownTask`]; [`MtgpError::Gp`] for inputs that are not finite or
    /// have another number of columns.
    pub fn predict(&self, task: usize, x: MatRef<'_, f64>) -> Result<Prediction, MtgpError> {
        let rows: Mat<f64> = self.covariance().rows_of(x, task)?;
        Ok(self.posterior.predict(rows.as_ref())?)
    }

    /// What the posterior is expanded in, with the task in the last column.
    pub(crate) fn basis_rows(&self) -> MatRef<'_, f64> {
        match &self.posterior {
            FitPosterior::Dense(posterior) => posterior.x(),
            FitPosterior::LowRank(posterior) => posterior.parts().pivots.as_ref(),
        }
    }

    /// The process at one state, with a scaling for every task.
    ///
    /// ```text
    /// c((p, δ), (x, γ)) = (K^ρ)_γδ c^x(p, x)
    /// ```
    pub(crate) fn predictor(&self) -> ProcessPredictor {
        let covariance = self.covariance();
        let k_task = covariance.task().k_task();
        let (points, tasks) = split(self.basis_rows(), covariance.n_tasks());
        let scaling = |task: usize| Scaling {
            of_points: tasks.iter().map(|&other| k_task[(other, task)]).collect(),
            of_prior: k_task[(task, task)],
        };
        let scalings = (0..covariance.n_tasks()).map(scaling).collect();
        ProcessPredictor::scaled(&self.posterior, covariance.input(), points, scalings)
    }
}

impl From<TaskFit> for TaskProcess {
    fn from(fit: TaskFit) -> Self {
        Self::new(fit.posterior, &fit.report)
    }
}

fn origin_name(origin: Origin) -> String {
    match origin {
        Origin::Moments(kind) => kind.to_string(),
        Origin::Pooled => "A.3 from pGP".to_owned(),
        Origin::Independent => "A.3 from iGP".to_owned(),
        Origin::LowerRank => "lower rank".to_owned(),
        Origin::Given => "given".to_owned(),
    }
}
