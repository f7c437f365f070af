//! One joint's torque in every context, learned by whatever.

use faer::{Mat, MatRef};
use gp_core::fit::BayesLinear;
use gp_core::{Posterior, Prediction};
use kernels::Covariance;
use mtgp::latent::predict_mean_of_all_tasks;
use mtgp::prior::{TaskCovariance, TaskRow};
use mtgp::{MultiTaskCovariance, TaskFit};

use crate::error::TorqueError;
use crate::fit_summary::FitSummary;
use crate::rows::{Rows, TaskRows, require_context, require_states};

/// The torque of one joint as a function of state and context.
pub trait TorqueFunction: Send + Sync {
    /// Number of joints ℓ of the robot.
    fn n_joints(&self) -> usize;

    /// Number of contexts; one for a function of one load.
    fn n_contexts(&self) -> usize {
        1
    }

    /// Variance of the noise of an observation, N²·m².
    fn noise_var(&self) -> f64;

    /// Means and latent variances of the torque at states under a context.
    ///
    /// # Shapes
    /// `x` (n, 3ℓ), columns (q, q̇, q̈).
    /// # Errors
    /// States that are not finite or of another robot, a context that there is not.
    fn predict(&self, context: usize, x: MatRef<'_, f64>) -> Result<Prediction, TorqueError>;

    /// The means alone, N·m.
    ///
    /// # Errors
    /// As for [`TorqueFunction::predict`].
    fn predict_mean(&self, context: usize, x: MatRef<'_, f64>) -> Result<Vec<f64>, TorqueError>;
}

/// A Gaussian process over a joint's torque: its posterior, how states become its rows, and how it was found.
#[derive(Debug, Clone)]
pub struct Process<C, R> {
    /// The process, conditioned on the data: of torques less what is known beforehand.
    pub posterior: Posterior<C>,
    /// How a state under a context becomes one of its rows.
    pub rows: R,
    /// How its hyperparameters were found.
    pub summary: FitSummary,
}

impl<C: Covariance + Send + Sync, R: Rows> TorqueFunction for Process<C, R> {
    fn n_joints(&self) -> usize {
        self.rows.n_joints()
    }

    fn n_contexts(&self) -> usize {
        self.rows.n_contexts()
    }

    fn noise_var(&self) -> f64 {
        self.posterior.noise_std().powi(2)
    }

    fn predict(&self, context: usize, x: MatRef<'_, f64>) -> Result<Prediction, TorqueError> {
        let rows = self.rows.rows(context, x)?;
        let mut prediction = self.posterior.predict(rows.as_ref())?;
        add_known(&self.rows, rows.as_ref(), &mut prediction.mean);
        Ok(prediction)
    }

    fn predict_mean(&self, context: usize, x: MatRef<'_, f64>) -> Result<Vec<f64>, TorqueError> {
        let rows = self.rows.rows(context, x)?;
        let mut mean = self.posterior.predict_mean(rows.as_ref())?;
        add_known(&self.rows, rows.as_ref(), &mut mean);
        Ok(mean)
    }
}

fn add_known(of: &impl Rows, rows: MatRef<'_, f64>, mean: &mut [f64]) {
    for (mean, known) in (mean.iter_mut()).zip(of.known_mean(rows).unwrap_or_default()) {
        *mean += known;
    }
}

impl TorqueFunction for BayesLinear {
    fn n_joints(&self) -> usize {
        self.n_joints()
    }

    fn noise_var(&self) -> f64 {
        self.noise_var()
    }

    fn predict(&self, context: usize, x: MatRef<'_, f64>) -> Result<Prediction, TorqueError> {
        require_context(context, 1)?;
        require_states(x, self.n_joints())?;
        Ok(Prediction {
            mean: self.predict_mean(x)?,
            var: self.predict_var(x)?,
            n_clamped: 0,
        })
    }

    fn predict_mean(&self, context: usize, x: MatRef<'_, f64>) -> Result<Vec<f64>, TorqueError> {
        require_context(context, 1)?;
        Ok(self.predict_mean(x)?)
    }
}

/// A multi-task process over one joint's torque in every context.
pub type TaskProcess = Process<MultiTaskCovariance, TaskRows>;

impl TaskProcess {
    /// A posterior of tasks, with the summary of how its hyperparameters were found.
    pub fn of_tasks(posterior: Posterior<MultiTaskCovariance>, summary: FitSummary) -> Self {
        Self {
            rows: TaskRows::of(posterior.covariance()),
            posterior,
            summary,
        }
    }

    /// The chapter's name of the model: iGP, pGP, or mGP with its rank; mGP(s) where K^ρ is by descriptors.
    pub fn name(&self) -> String {
        match self.covariance().task() {
            TaskCovariance::Identity { .. } => "iGP".to_owned(),
            TaskCovariance::Ones { .. } => "pGP".to_owned(),
            task @ TaskCovariance::Factor(_) => format!("mGP-{}", task.rank()),
            TaskCovariance::Described(_) => "mGP(s)".to_owned(),
        }
    }

    /// The prior with its hyperparameters.
    pub fn covariance(&self) -> &MultiTaskCovariance {
        self.posterior.covariance()
    }

    /// Posterior means of every context at states, (k, m), N·m: see
    /// [`mtgp::latent::predict_mean_of_all_tasks`].
    ///
    /// # Shapes
    /// `x` (k, 3ℓ).
    /// # Errors
    /// States that are not finite or of another robot.
    pub fn predict_mean_of_all_contexts(
        &self,
        x: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, TorqueError> {
        Ok(predict_mean_of_all_tasks(&self.posterior, x)?)
    }

    /// The process with one more task of a given row; nothing else changes.
    ///
    /// The posterior given the old data stays as it is, and so do the predictions of the old
    /// contexts, to the bit.
    /// # Errors
    /// As for [`TaskCovariance::with_row`].
    pub fn with_row(&self, row: &TaskRow) -> Result<Self, TorqueError> {
        Ok(self.with_tasks(self.covariance().task().with_row(row)?))
    }

    /// The process with one more task of which the descriptors are known; `None` where K^ρ is not by descriptors.
    ///
    /// The predictions of the other tasks stay, to the bit.
    /// # Errors
    /// As for [`TaskCovariance::with_described`].
    pub fn with_described(&self, descriptor: &[f64]) -> Option<Result<Self, TorqueError>> {
        let grown = self.covariance().task().with_described(descriptor)?;
        Some(
            grown
                .map(|task| self.with_tasks(task))
                .map_err(TorqueError::from),
        )
    }

    /// The same posterior given the old data, with a K^ρ of which that of the old tasks is a part.
    fn with_tasks(&self, task: TaskCovariance) -> Self {
        let grown = MultiTaskCovariance::new(self.covariance().input().clone(), task);
        let posterior = self.posterior.with_covariance(grown);
        Self::of_tasks(posterior, self.summary.clone())
    }

    /// The process conditioned on further torques of a task, with the same hyperparameters.
    ///
    /// ```text
    /// p(f | D, D*),   as if all samples had been conditioned on at once
    /// ```
    /// # Shapes
    /// `x` (k, 3ℓ); `torques` (k,), N·m.
    /// # Errors
    /// As for [`Posterior::with_samples`]; a task that there is not.
    pub fn with_samples(
        &self,
        task: usize,
        x: MatRef<'_, f64>,
        torques: &[f64],
    ) -> Result<Self, TorqueError> {
        self.with_correlated_samples(task, x, torques, 1.0)
    }

    /// The same of torques whose noise is correlated, c of which tell as much as one: their noise is σ √c.
    ///
    /// # Errors
    /// As for [`TaskProcess::with_samples`]; c that is not positive.
    pub fn with_correlated_samples(
        &self,
        task: usize,
        x: MatRef<'_, f64>,
        torques: &[f64],
        correlation: f64,
    ) -> Result<Self, TorqueError> {
        let rows = self.rows.rows(task, x)?;
        let noise_std = self.posterior.noise_std() * correlation.sqrt();
        let posterior =
            (self.posterior).with_samples_of_noise(rows.as_ref(), torques, noise_std)?;
        let summary = FitSummary {
            rank: posterior.rank(),
            condition_lower_bound: posterior.condition_lower_bound(),
            ..self.summary.clone()
        };
        Ok(Self::of_tasks(posterior, summary))
    }
}

impl From<TaskFit> for TaskProcess {
    fn from(fit: TaskFit) -> Self {
        let summary = FitSummary::of(&fit.report);
        Self::of_tasks(fit.posterior, summary)
    }
}
