//! The model of one joint's torque with an informative prior: rbd or rbd+gp, as a file keeps it.

use faer::MatRef;
use kernels::{Covariance, OnColumns, Sum};
use serde::{Deserialize, Serialize};

use crate::error::GpError;
use crate::fit::{
    Fit, InformedFit, ParameterPrior, RigidBodyAndProcess, RigidBodyCovariance, predict_informed,
};
use crate::model::file::ModelFileError;
use crate::model::joint_model::FitSummary;
use crate::model::matrix_record::{malformed, require_values};
use crate::model::process_record::{ParamsRecord, PosteriorRecord, SummaryRecord};
use crate::posterior::Posterior;
use crate::posterior::Prediction;
use crate::search::StageReport;

/// A torque that is linear in parameters of known prior, alone or with a process on what they leave.
///
/// # Source
/// Sec. 3.2.
#[derive(Debug, Clone)]
pub struct InformedModel {
    prior: ParameterPrior,
    process: InformedProcess,
    summary: FitSummary,
}

/// The process of t − Y(x)π₀ in rows (x, Y(x)).
#[derive(Debug, Clone)]
enum InformedProcess {
    Parameters(Box<Posterior<RigidBodyCovariance>>),
    AndRemainder(Box<Posterior<RigidBodyAndProcess>>),
}

impl InformedModel {
    /// Name of the model: rbd or rbd+gp.
    pub fn name(&self) -> &'static str {
        match self.process {
            InformedProcess::Parameters(_) => "rbd",
            InformedProcess::AndRemainder(_) => "rbd+gp",
        }
    }

    /// Factor s of the prior's standard deviations, as learned.
    pub fn spread(&self) -> f64 {
        match &self.process {
            InformedProcess::Parameters(p) => p.covariance().inner().spread(),
            InformedProcess::AndRemainder(p) => p.covariance().second().inner().spread(),
        }
    }

    /// The covariance of what the parameters leave; `None` for rbd.
    pub fn remainder(&self) -> Option<&kernels::TorqueCovariance> {
        match &self.process {
            InformedProcess::Parameters(_) => None,
            InformedProcess::AndRemainder(p) => Some(p.covariance().first().inner()),
        }
    }

    /// Standard deviation of the noise σ, N·m.
    pub fn noise_std(&self) -> f64 {
        match &self.process {
            InformedProcess::Parameters(p) => p.noise_std(),
            InformedProcess::AndRemainder(p) => p.noise_std(),
        }
    }

    /// How the hyperparameters were found.
    pub fn summary(&self) -> &FitSummary {
        &self.summary
    }

    /// Posterior means and latent variances of the torque at rows of x, (n, d), and Y, (n, p).
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Panics
    /// If x and Y do not have as many rows.
    pub fn predict(
        &self,
        x: MatRef<'_, f64>,
        regressor: MatRef<'_, f64>,
    ) -> Result<Prediction, GpError> {
        match &self.process {
            InformedProcess::Parameters(p) => predict_informed(&self.prior, p, x, regressor),
            InformedProcess::AndRemainder(p) => predict_informed(&self.prior, p, x, regressor),
        }
    }
}

impl From<InformedFit<RigidBodyCovariance>> for InformedModel {
    fn from(learned: InformedFit<RigidBodyCovariance>) -> Self {
        Self {
            summary: summary_of(&learned.fit),
            prior: learned.prior,
            process: InformedProcess::Parameters(Box::new(learned.fit.posterior)),
        }
    }
}

impl From<InformedFit<RigidBodyAndProcess>> for InformedModel {
    fn from(learned: InformedFit<RigidBodyAndProcess>) -> Self {
        Self {
            summary: summary_of(&learned.fit),
            prior: learned.prior,
            process: InformedProcess::AndRemainder(Box::new(learned.fit.posterior)),
        }
    }
}

/// The start is named by its number, as all are given.
fn summary_of<C: Covariance>(fit: &Fit<C>) -> FitSummary {
    let first = fit.report.stages.first().and_then(StageReport::winner);
    FitSummary {
        start: (first.unwrap_or_default() + 1).to_string(),
        ..FitSummary::of(&fit.report)
    }
}

/// The plain record of a model.
#[derive(Debug, Serialize, Deserialize)]
pub struct InformedRecord {
    prior_mean: Vec<f64>,
    prior_std: Vec<f64>,
    spread: f64,
    remainder: Option<ParamsRecord>,
    posterior: PosteriorRecord,
    summary: SummaryRecord,
}

impl InformedRecord {
    /// The record of a model.
    pub fn of(model: &InformedModel) -> Self {
        Self {
            prior_mean: model.prior.mean.clone(),
            prior_std: model.prior.std.clone(),
            spread: model.spread(),
            remainder: model.remainder().map(ParamsRecord::of),
            posterior: match &model.process {
                InformedProcess::Parameters(p) => PosteriorRecord::of(p),
                InformedProcess::AndRemainder(p) => PosteriorRecord::of(p),
            },
            summary: SummaryRecord::of(&model.summary),
        }
    }

    /// The model of `n_joints` joints with `n_parameters` parameters.
    ///
    /// # Errors
    /// [`ModelFileError::Malformed`] with what does not fit or is not a finite number.
    pub fn into_model(
        self,
        n_joints: usize,
        n_parameters: usize,
    ) -> Result<InformedModel, ModelFileError> {
        require_values("means of parameters", &self.prior_mean, n_parameters)?;
        require_values("standard deviations", &self.prior_std, n_parameters)?;
        require_values("spread", &[self.spread], 1)?;
        let prior = ParameterPrior {
            mean: self.prior_mean,
            std: self.prior_std,
        };
        let n_inputs = 3 * n_joints;
        let of_parameters = prior
            .covariance_at(n_inputs, self.spread)
            .map_err(malformed)?;
        let n_columns = n_inputs + n_parameters;
        let process = match self.remainder {
            None => {
                let posterior = self.posterior.into_posterior(of_parameters, n_columns)?;
                InformedProcess::Parameters(Box::new(posterior))
            }
            Some(params) => {
                let remainder = params.into_covariance()?;
                let found = remainder.n_joints();
                if found != n_joints {
                    return Err(malformed(format!("a covariance of {found} joints")));
                }
                let covariance = Sum::new(OnColumns::new(remainder, 0..n_inputs), of_parameters);
                let posterior = self.posterior.into_posterior(covariance, n_columns)?;
                InformedProcess::AndRemainder(Box::new(posterior))
            }
        };
        Ok(InformedModel {
            prior,
            process,
            summary: self.summary.into_summary()?,
        })
    }
}
