//! The model of one joint's torque: linear, or a Gaussian process with the summary of its fit.

use std::fmt;

use faer::MatRef;
use kernels::TorqueForm;

use crate::error::GpError;
use crate::fit::Fit;
use crate::fit::{BayesLinear, LINEAR_NOISE_VAR, LinearForm};
use crate::posterior::Posterior;
use crate::posterior::Prediction;
use crate::search::FitReport;

/// The four models of sec. 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelKind {
    /// LR¬c: linear without friction.
    LinearSmooth,
    /// LRc: linear with the signs of the velocities.
    LinearCoulomb,
    /// GP¬c: Gaussian process without friction.
    ProcessSmooth,
    /// GPc: Gaussian process with friction.
    ProcessCoulomb,
}

impl fmt::Display for ModelKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::LinearSmooth => "LR¬c",
            Self::LinearCoulomb => "LRc",
            Self::ProcessSmooth => "GP¬c",
            Self::ProcessCoulomb => "GPc",
        })
    }
}

/// What a model keeps of the fit of its hyperparameters.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSummary {
    /// Log marginal likelihood, natural log, summed over the data.
    pub log_marginal: f64,
    /// The start that won.
    pub start: String,
    /// Starts tried.
    pub n_starts: usize,
    /// Likelihoods with gradient, of all starts together.
    pub evaluations: usize,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// A lower bound on the condition number of K + σ²I.
    pub condition_lower_bound: f64,
    /// How K was factorised: `dense` or `certified`, the low-rank path.
    pub method: String,
    /// Rank of the factorisation; n for a dense one.
    pub rank: usize,
    /// Bound on the error of the log marginal likelihood, in nats; `None` if not known.
    pub error_bound: Option<f64>,
}

impl FitSummary {
    /// What a model keeps of a report.
    ///
    /// # Panics
    /// If the report has no stage, which that of a fit never is.
    pub fn of(report: &FitReport) -> Self {
        Self {
            log_marginal: report.log_marginal,
            start: report.origin().to_string(),
            n_starts: report.stages.first().map_or(0, |stage| stage.starts.len()),
            evaluations: report.evaluations(),
            bounds_hit: report.bounds_hit.clone(),
            condition_lower_bound: report.condition_lower_bound,
            method: report.method.to_string(),
            rank: report.rank,
            error_bound: Some(report.error_bound),
        }
    }
}

/// A Gaussian process over one joint's torque, with the summary of its fit.
#[derive(Debug, Clone)]
pub struct ProcessModel {
    /// The process, conditioned on the data.
    pub posterior: Posterior,
    /// How its hyperparameters were found.
    pub summary: FitSummary,
}

/// The model of one joint's torque.
#[derive(Debug, Clone)]
pub enum JointModel {
    /// LR¬c or LRc, eq. (9).
    Linear(BayesLinear),
    /// GP¬c or GPc, eqs. (3)–(7).
    Process(Box<ProcessModel>),
}

impl JointModel {
    /// Which of the four models of sec. 3 it is.
    pub fn kind(&self) -> ModelKind {
        match self {
            Self::Linear(linear) => match linear.form() {
                LinearForm::Smooth => ModelKind::LinearSmooth,
                LinearForm::Coulomb => ModelKind::LinearCoulomb,
            },
            Self::Process(process) => match process.posterior.covariance().form() {
                TorqueForm::Smooth => ModelKind::ProcessSmooth,
                TorqueForm::Coulomb => ModelKind::ProcessCoulomb,
            },
        }
    }

    /// Number of joints ℓ of the robot it predicts for.
    pub fn n_joints(&self) -> usize {
        match self {
            Self::Linear(linear) => linear.n_joints(),
            Self::Process(process) => process.posterior.covariance().n_joints(),
        }
    }

    /// Variance of the noise of an observation, in squared target units.
    pub fn noise_var(&self) -> f64 {
        match self {
            Self::Linear(_) => LINEAR_NOISE_VAR,
            Self::Process(process) => process.posterior.noise_std().powi(2),
        }
    }

    /// How the hyperparameters were found; `None` for a linear model, which has none.
    pub fn summary(&self) -> Option<&FitSummary> {
        match self {
            Self::Linear(_) => None,
            Self::Process(process) => Some(&process.summary),
        }
    }

    /// Means and latent variances at the rows of `x`, (n, 3ℓ).
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict(&self, x: MatRef<'_, f64>) -> Result<Prediction, GpError> {
        match self {
            Self::Linear(linear) => Ok(Prediction {
                mean: linear.predict_mean(x)?,
                var: linear.predict_var(x)?,
                n_clamped: 0,
            }),
            Self::Process(process) => process.posterior.predict(x),
        }
    }
}

impl From<BayesLinear> for JointModel {
    fn from(linear: BayesLinear) -> Self {
        Self::Linear(linear)
    }
}

impl From<Fit> for JointModel {
    fn from(fit: Fit) -> Self {
        let summary = FitSummary::of(&fit.report);
        Self::Process(Box::new(ProcessModel {
            posterior: fit.posterior,
            summary,
        }))
    }
}
