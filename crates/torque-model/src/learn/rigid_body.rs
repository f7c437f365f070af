//! rbd and rbd+gp: the robot's description as prior, which data correct, sec. 3.2.

use std::sync::Arc;

use faer::MatRef;
use gp_core::fit::{
    InformedFit, ParameterPrior, RegressorSamples, RigidBodyAndProcess, RigidBodyCovariance,
    fit_rigid_body, fit_rigid_body_and_process,
};
use gp_core::{FitOptions, GpError};
use kernels::TorqueForm;
use puma_dyn::dynamics::{
    N_DRIVE_PARAMETERS, N_PARAMETERS, ParameterSpread, drive_parameters, inertial_parameters,
};
use puma_dyn::{Context, Effects, Friction};

use crate::error::{TorqueError, consistent};
use crate::joint_model::JointModel;
use crate::learn::candidate::Candidate;
use crate::learn::learner::Learn;
use crate::robot_source::Robot;
use crate::rows::{RegressorRows, regressor_of};
use crate::samples::{JointTorques, Samples};

/// Torque of a drive parameter that the description does not state, one standard deviation, as a part of the
/// joint's torques: both root mean squares.
const UNSTATED_PART: f64 = 0.1;

/// Whether a process stands beside the parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RigidBodyForm {
    /// rbd.
    Alone,
    /// rbd+gp, with GPc's covariance.
    WithProcess,
}

impl RigidBodyForm {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Alone, Self::WithProcess];

    /// rbd or rbd+gp.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alone => "rbd",
            Self::WithProcess => "rbd+gp",
        }
    }
}

/// A robot's parameters about their described values.
#[derive(Debug, Clone)]
pub struct RigidBody {
    /// The robot, and what of its drives counts.
    pub robot: Robot,
    /// Whether there is a process on what they leave.
    pub form: RigidBodyForm,
    /// What is known of the parameters of (bodies, drives) before any data.
    pub prior: ParameterPrior,
    /// How the hyperparameters are searched for.
    pub options: FitOptions,
}

/// A joint's torque with a robot's parameters, learned.
#[derive(Debug, Clone)]
pub enum InformedJoint {
    /// rbd.
    Alone(Box<InformedFit<RigidBodyCovariance>>),
    /// rbd+gp.
    WithProcess(Box<InformedFit<RigidBodyAndProcess>>),
}

impl RigidBody {
    /// The description's values with their usual uncertainty, and an unknown load behind the last joint.
    pub fn new(robot: Robot, form: RigidBodyForm, options: FitOptions) -> Self {
        let mut mean = inertial_parameters(&robot.model, &Context::empty());
        mean.extend(drive_parameters(&robot.model, robot.effects));
        let std = ParameterSpread::default().std_with_load(&mean);
        Self {
            robot,
            form,
            prior: ParameterPrior { mean, std },
            options,
        }
    }

    /// Learns a joint from rows of Y and torques; x is what a process on the remainder sees.
    ///
    /// # Errors
    /// Samples that do not fit together, or cannot be learned from.
    /// # Panics
    /// If the joint does not exist.
    pub fn fit(
        &self,
        joint_idx: usize,
        samples: RegressorSamples<'_>,
    ) -> Result<InformedJoint, TorqueError> {
        let prior = self.prior_of(joint_idx, samples.regressor, samples.targets);
        InformedJoint::learn(self.form, &prior, samples, &self.options)
    }

    /// What is known of a joint's parameters, also of what its description does not state of its drive.
    fn prior_of(
        &self,
        joint_idx: usize,
        regressor: MatRef<'_, f64>,
        torques: &[f64],
    ) -> ParameterPrior {
        let mut prior = self.prior.clone();
        let effects = self.robot.effects;
        allow_for_unstated_drive(&mut prior, effects, joint_idx, regressor, torques);
        prior
    }
}

impl InformedJoint {
    /// Learns torques that are linear in parameters of a prior, from rows of Y in their order.
    ///
    /// # Errors
    /// As for [`gp_core::fit::fit_informed`].
    pub fn learn(
        form: RigidBodyForm,
        prior: &ParameterPrior,
        samples: RegressorSamples<'_>,
        options: &FitOptions,
    ) -> Result<Self, TorqueError> {
        Ok(match form {
            RigidBodyForm::Alone => Self::Alone(Box::new(fit_rigid_body(samples, prior, options)?)),
            RigidBodyForm::WithProcess => {
                let form = TorqueForm::Coulomb;
                let fit = fit_rigid_body_and_process(samples, prior, form, options)?;
                Self::WithProcess(Box::new(fit))
            }
        })
    }

    /// Posterior mean of the parameters, (p,): the rigid body's torque is Y times it.
    ///
    /// # Errors
    /// Numbers that overflow.
    pub fn parameter_mean(&self) -> Result<Vec<f64>, GpError> {
        match self {
            Self::Alone(fit) => fit.parameter_mean(),
            Self::WithProcess(fit) => fit.parameter_mean(),
        }
    }
}

impl Learn for RigidBody {
    fn name(&self) -> String {
        self.form.name().to_owned()
    }

    fn robot(&self) -> Option<&Robot> {
        Some(&self.robot)
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        _tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        let (robot, names) = (&self.robot.model, &samples.joint_names);
        consistent((robot.n_joints() != names.len()).then(|| {
            format!(
                "samples of {} joints for a robot of {}",
                names.len(),
                robot.n_joints()
            )
        }))?;
        let y = regressor_of(robot, joint.joint_idx, samples.x.as_ref())?;
        let of_joint = RegressorSamples {
            x: samples.x.as_ref(),
            regressor: y.as_ref(),
            targets: &joint.values,
        };
        let options = FitOptions {
            continuous: samples.continuous.clone(),
            ..self.options.clone()
        };
        let learner = Self {
            options,
            ..self.clone()
        };
        let fit = learner.fit(joint.joint_idx, of_joint)?;
        let rows = |prior: &ParameterPrior| RegressorRows {
            robot: Arc::clone(robot),
            joint_idx: joint.joint_idx,
            prior: prior.clone(),
        };
        let model = match fit {
            InformedJoint::Alone(fit) => {
                let rows = rows(&fit.prior);
                JointModel::of_rigid_body(*fit, rows)
            }
            InformedJoint::WithProcess(fit) => {
                let rows = rows(&fit.prior);
                JointModel::of_rigid_body_and_process(*fit, rows)
            }
        };
        Ok(vec![model.into()])
    }
}

/// Makes what the description leaves at zero of a joint's drive uncertain, as far as the effects have it.
fn allow_for_unstated_drive(
    prior: &mut ParameterPrior,
    effects: Effects,
    joint_idx: usize,
    regressor: MatRef<'_, f64>,
    torques: &[f64],
) {
    let n_joints = regressor.ncols() / (N_PARAMETERS + N_DRIVE_PARAMETERS);
    let first = n_joints * N_PARAMETERS + joint_idx * N_DRIVE_PARAMETERS;
    let has_friction = effects.friction != Friction::None;
    for idx in 0..N_DRIVE_PARAMETERS {
        let is_part = if idx == 0 {
            effects.rotor_inertia
        } else {
            has_friction
        };
        let column = regressor.col(first + idx);
        let size = column.squared_norm_l2().sqrt();
        if is_part && prior.std[first + idx] == 0.0 && size > 0.0 {
            let of_torques = torques.iter().map(|t| t * t).sum::<f64>().sqrt();
            prior.std[first + idx] = UNSTATED_PART * of_torques / size;
        }
    }
}
