//! The models of section 3.4, fitted to raw covariates (no standardisation, as in the chapter).

use faer::MatRef;
use gp_core::{BayesLinear, Fit, FitOptions, LinearForm};
use kernels::{Covariance, TorqueForm};

use crate::cell::ModelKind;
use crate::error::BenchError;
use crate::fit_summary::FitSummary;

/// A model after training.
pub enum Fitted {
    /// LR¬c or LRc.
    Linear(BayesLinear),
    /// GP¬c or GPc.
    Process(Box<Fit>),
}

impl Fitted {
    /// Trains a model of one joint's torque.
    ///
    /// # Shapes
    /// `x` (n, 18) with columns (q, q̇, q̈); `targets` (n,), N·m.
    /// # Errors
    /// `Fit` with the reason.
    /// # Panics
    /// For a model that needs more than states: those of [`ModelKind::rigid_body`].
    /// # Source
    /// Eq. (9) for LR; eqs. (5)–(8) and (22) for GP.
    pub fn fit(kind: ModelKind, x: MatRef<'_, f64>, targets: &[f64]) -> Result<Self, BenchError> {
        let linear = |form| BayesLinear::fit(x, targets, form).map(Self::Linear);
        let process = |form| {
            let fit = gp_core::fit(x, targets, form, &FitOptions::several());
            fit.map(|fit| Self::Process(Box::new(fit)))
        };
        Ok(match kind {
            ModelKind::LrSmooth => linear(LinearForm::Smooth)?,
            ModelKind::LrCoulomb => linear(LinearForm::Coulomb)?,
            ModelKind::GpSmooth => process(TorqueForm::Smooth)?,
            ModelKind::GpCoulomb => process(TorqueForm::Coulomb)?,
            ModelKind::RigidBodyAndProcess
            | ModelKind::SharedParameters
            | ModelKind::SharedParametersSigns => {
                panic!("{} needs a regressor beside the states", kind.name())
            }
        })
    }

    /// Predicted torques at the rows of `x`, N·m.
    ///
    /// # Errors
    /// `Fit` if `x` does not have the training inputs' columns or is not finite.
    pub fn predict_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, BenchError> {
        Ok(match self {
            Self::Linear(model) => model.predict_mean(x)?,
            Self::Process(fit) => fit.posterior.predict_mean(x)?,
        })
    }

    /// What the optimiser reported; nothing for linear regression, which has no hyperparameters.
    pub fn summary(&self) -> Option<FitSummary> {
        let Self::Process(fit) = self else {
            return None;
        };
        let hyperparameters = fit.covariance().params();
        let summary = FitSummary::of(&fit.report, fit.noise_std(), hyperparameters);
        Some(summary)
    }
}
