//! The model of one joint's torque: the five that a file can hold.

use std::sync::Arc;

use faer::MatRef;
use gp_core::fit::{
    BayesLinear, InformedFit, LinearForm, RigidBodyAndProcess, RigidBodyCovariance,
};
use gp_core::{Fit, Prediction};
use kernels::{TorqueCovariance, TorqueForm};
use mtgp::TaskFit;

use crate::error::TorqueError;
use crate::fit_summary::FitSummary;
use crate::process::{Process, TaskProcess, TorqueFunction};
use crate::rigid_body::{ParameterPosterior, SharedJoint};
use crate::rows::{RegressorRows, States};

/// The model of one joint's torque.
#[derive(Debug, Clone)]
pub enum JointModel {
    /// LR¬c or LRc, eq. (9).
    Linear(BayesLinear),
    /// GP¬c or GPc, eqs. (3)–(7).
    Process(Box<Process<TorqueCovariance, States>>),
    /// mGP, iGP or pGP, eq. (16).
    Tasks(Box<TaskProcess>),
    /// rbd: linear in parameters of known prior, sec. 3.2.
    RigidBody(Box<Process<RigidBodyCovariance, RegressorRows>>),
    /// rbd+gp: the same, with a process on what the parameters leave.
    RigidBodyAndProcess(Box<Process<RigidBodyAndProcess, RegressorRows>>),
    /// rbd of all joints and loads together.
    Shared(Box<SharedJoint>),
}

impl JointModel {
    /// The model as a function of state and context.
    pub fn function(&self) -> &dyn TorqueFunction {
        match self {
            Self::Linear(linear) => linear,
            Self::Process(process) => process.as_ref(),
            Self::Tasks(process) => process.as_ref(),
            Self::RigidBody(process) => process.as_ref(),
            Self::RigidBodyAndProcess(process) => process.as_ref(),
            Self::Shared(joint) => joint.as_ref(),
        }
    }

    /// Its name in tables: that of the chapter, or rbd and rbd+gp.
    pub fn name(&self) -> String {
        match self {
            Self::Linear(linear) => linear_name(linear.form()).to_owned(),
            Self::Process(process) => {
                process_name(process.posterior.covariance().form()).to_owned()
            }
            Self::Tasks(process) => process.name(),
            Self::RigidBody(_) | Self::Shared(_) => "rbd".to_owned(),
            Self::RigidBodyAndProcess(_) => "rbd+gp".to_owned(),
        }
    }

    /// The covariance of eq. (7) that it has or is made of; `None` without one.
    pub fn input_covariance(&self) -> Option<&TorqueCovariance> {
        match self {
            Self::Linear(_) | Self::RigidBody(_) | Self::Shared(_) => None,
            Self::Process(process) => Some(process.posterior.covariance()),
            Self::Tasks(process) => Some(process.covariance().input()),
            Self::RigidBodyAndProcess(process) => {
                Some(process.posterior.covariance().first().inner())
            }
        }
    }

    /// Factor s of the prior's standard deviations of a rigid body, as learned.
    pub fn spread(&self) -> Option<f64> {
        match self {
            Self::RigidBody(process) => Some(process.posterior.covariance().inner().spread()),
            Self::RigidBodyAndProcess(process) => {
                Some(process.posterior.covariance().second().inner().spread())
            }
            Self::Linear(_) | Self::Process(_) | Self::Tasks(_) | Self::Shared(_) => None,
        }
    }

    /// The process of several contexts; `None` for a model of one.
    pub fn tasks(&self) -> Option<&TaskProcess> {
        match self {
            Self::Tasks(process) => Some(process),
            _ => None,
        }
    }

    /// The posterior of parameters that it shares with other joints; `None` for a model of its own.
    pub fn posterior(&self) -> Option<&Arc<ParameterPosterior>> {
        match self {
            Self::Shared(joint) => Some(joint.posterior()),
            _ => None,
        }
    }

    /// Variance of the noise of an observation, N²·m².
    pub fn noise_var(&self) -> f64 {
        self.function().noise_var()
    }

    /// Its root, N·m, as the model has it.
    pub fn noise_std(&self) -> f64 {
        match self {
            Self::Linear(_) => self.noise_var().sqrt(),
            Self::Shared(joint) => joint.noise().std,
            Self::Process(process) => process.posterior.noise_std(),
            Self::Tasks(process) => process.posterior.noise_std(),
            Self::RigidBody(process) => process.posterior.noise_std(),
            Self::RigidBodyAndProcess(process) => process.posterior.noise_std(),
        }
    }

    /// How the hyperparameters were found; `None` for models in closed form, which have none.
    pub fn summary(&self) -> Option<&FitSummary> {
        match self {
            Self::Linear(_) | Self::Shared(_) => None,
            Self::Process(process) => Some(&process.summary),
            Self::Tasks(process) => Some(&process.summary),
            Self::RigidBody(process) => Some(&process.summary),
            Self::RigidBodyAndProcess(process) => Some(&process.summary),
        }
    }

    /// Means and latent variances at states under a context, (n, 3ℓ): see [`TorqueFunction::predict`].
    ///
    /// # Errors
    /// As there.
    pub fn predict(&self, context: usize, x: MatRef<'_, f64>) -> Result<Prediction, TorqueError> {
        self.function().predict(context, x)
    }

    /// rbd, learned.
    pub fn of_rigid_body(fit: InformedFit<RigidBodyCovariance>, rows: RegressorRows) -> Self {
        Self::RigidBody(Box::new(informed(fit, rows)))
    }

    /// rbd+gp, learned.
    pub fn of_rigid_body_and_process(
        fit: InformedFit<RigidBodyAndProcess>,
        rows: RegressorRows,
    ) -> Self {
        Self::RigidBodyAndProcess(Box::new(informed(fit, rows)))
    }
}

/// The chapter's name of a linear model.
pub(crate) fn linear_name(form: LinearForm) -> &'static str {
    match form {
        LinearForm::Smooth => "LR¬c",
        LinearForm::Coulomb => "LRc",
    }
}

/// The chapter's name of a process of one load.
pub(crate) fn process_name(form: TorqueForm) -> &'static str {
    match form {
        TorqueForm::Smooth => "GP¬c",
        TorqueForm::Coulomb => "GPc",
    }
}

fn informed<C: kernels::Covariance>(
    fit: InformedFit<C>,
    rows: RegressorRows,
) -> Process<C, RegressorRows> {
    Process {
        summary: FitSummary::of_given(&fit.fit.report),
        posterior: fit.fit.posterior,
        rows,
    }
}

impl From<BayesLinear> for JointModel {
    fn from(linear: BayesLinear) -> Self {
        Self::Linear(linear)
    }
}

impl From<Fit> for JointModel {
    fn from(fit: Fit) -> Self {
        Self::Process(Box::new(Process {
            rows: States {
                n_joints: fit.covariance().n_joints(),
            },
            summary: FitSummary::of(&fit.report),
            posterior: fit.posterior,
        }))
    }
}

impl From<TaskProcess> for JointModel {
    fn from(process: TaskProcess) -> Self {
        Self::Tasks(Box::new(process))
    }
}

impl From<TaskFit> for JointModel {
    fn from(fit: TaskFit) -> Self {
        TaskProcess::from(fit).into()
    }
}
