//! A model of several contexts learns one more from a few of its torques: section 5, novel contexts.

use std::sync::Arc;

use faer::MatRef;
use gp_core::optimize::MinimizeOptions;
use mtgp::latent::LatentFunctions;
use mtgp::novel::{Border, NewTorques, fit_row, fit_row_from_population};
use mtgp::prior::TaskRow;

use crate::error::{TorqueError, consistent};
use crate::joint_model::JointModel;
use crate::process::TaskProcess;
use crate::provenance::Provenance;
use crate::rigid_body::{LEAST_SECONDS, ParameterPosterior, SharedJoint};
use crate::robot_model::RobotModel;
use crate::samples::Samples;

/// Rows that are learned from at most, with the model conditioned on them and without.
const ROWS: usize = 200;
const ROWS_OF_ROW_ONLY: usize = 20;

/// Known rows that a search for the new one sets out from, beside least squares.
const N_NEAREST: usize = 2;

/// What the context of data that name none is called once there is another.
pub const FIRST_CONTEXT: &str = "first";

/// How a new context is learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Adapt {
    /// Whether the row of Λ is all that is learned: the known contexts are then predicted exactly as
    /// before, and the new one less well.
    pub is_row_only: bool,
    /// Whether the known rows are a prior of the new one; else it is that of maximum likelihood.
    pub has_prior: bool,
    /// Rows that are learned from at most, evenly spread; 200 if not given, or 20 for the row alone,
    /// since more of them on few trajectories bend the row to what the model gets wrong there.
    pub most_rows: Option<usize>,
}

impl Default for Adapt {
    fn default() -> Self {
        Self {
            is_row_only: false,
            has_prior: true,
            most_rows: None,
        }
    }
}

impl Adapt {
    fn most_rows(&self) -> usize {
        let usual = if self.is_row_only {
            ROWS_OF_ROW_ONLY
        } else {
            ROWS
        };
        self.most_rows.unwrap_or(usual)
    }
}

/// The model with one more context, learned from its torques.
///
/// The new context is a new row of Λ, learned for each joint, and the model is conditioned on the
/// torques as on those that it was learned from, which the known contexts profit from, too;
/// hyperparameters stay.
///
/// Of rows with times, those of [`LEAST_SECONDS`] tell as much as one: their noise has a variance so many times as large.
/// # Shapes
/// `samples` of the new context, with torques of every learned joint.
/// # Errors
/// [`TorqueError::OtherKind`] for a model of one context; [`TorqueError::InconsistentModel`] for a name
/// that is taken or torques of other joints; [`TorqueError::Joint`] for one that cannot be learned.
/// # Source
/// Section 5: novel contexts.
pub fn adapt(
    model: &RobotModel,
    name: &str,
    samples: &Samples,
    how: Adapt,
    provenance: Provenance,
) -> Result<RobotModel, TorqueError> {
    let joints: Vec<usize> = samples.torques.iter().map(|t| t.joint_idx).collect();
    let learned: Vec<usize> = model.learned().iter().map(|(idx, _)| *idx).collect();
    consistent(
        (joints != learned)
            .then(|| format!("torques of joints {joints:?} for models of {learned:?}")),
    )?;
    if let Some(posterior) = model.rigid_body() {
        return adapt_parameters(model, posterior, name, samples, provenance);
    }
    let few = samples.spread(how.most_rows());
    let correlation = few.rows_per_independent(LEAST_SECONDS)?;
    let mut parts = model.parts().clone();
    for ((_, joint_model), torques) in parts.learned.iter_mut().zip(&few.torques) {
        let Some(process) = joint_model.tasks() else {
            let what = "a model of one context cannot learn another".to_owned();
            return Err(TorqueError::OtherKind { what });
        };
        let rows = NewRows {
            x: few.x.as_ref(),
            torques: &torques.values,
            correlation,
        };
        let grown = rows.learned_by(process, how);
        let grown = grown.map_err(|cause| TorqueError::Joint {
            joint: model.joint_names()[torques.joint_idx].clone(),
            cause: Box::new(cause),
        })?;
        *joint_model = JointModel::from(grown);
    }
    let ranges = samples.ranges()?;
    parts.contexts.push(name.to_owned());
    parts.ranges = parts.ranges.union(&ranges);
    parts.context_ranges.push(ranges);
    parts.provenance = provenance;
    RobotModel::new(parts)
}

/// The same of a robot's parameters, in closed form: all rows count, and a context that is known learns more of its load.
fn adapt_parameters(
    model: &RobotModel,
    posterior: &Arc<ParameterPosterior>,
    name: &str,
    samples: &Samples,
    provenance: Provenance,
) -> Result<RobotModel, TorqueError> {
    let ranges = samples.ranges()?;
    let mut parts = model.parts().clone();
    let known = parts.contexts.iter().position(|context| context == name);
    let grown = match known {
        Some(context) => posterior.given(context, samples)?,
        None if parts.contexts.is_empty() => {
            let named = posterior.with_first_context(FIRST_CONTEXT)?;
            parts.contexts.push(FIRST_CONTEXT.to_owned());
            parts.context_ranges.push(parts.ranges.clone());
            named.with_context(name)?.given(1, samples)?
        }
        None => (posterior.with_context(name)?).given(posterior.n_contexts(), samples)?,
    };
    if let Some(context) = known {
        parts.context_ranges[context] = parts.context_ranges[context].union(&ranges);
    } else {
        parts.contexts.push(name.to_owned());
        parts.context_ranges.push(ranges.clone());
    }
    parts.ranges = parts.ranges.union(&ranges);
    parts.provenance = provenance;
    let grown = Arc::new(grown);
    for (joint_idx, joint_model) in &mut parts.learned {
        if let Some(joint) = SharedJoint::new(&grown, *joint_idx) {
            *joint_model = JointModel::Shared(Box::new(joint));
        }
    }
    RobotModel::new(parts)
}

/// The process of one joint with one more task, learned from torques of it, each of which tells something of its own.
///
/// # Shapes
/// `x` (k, 3ℓ); `torques` (k,), N·m.
/// # Errors
/// Shapes and numbers of inputs and torques; a search without a usable start.
/// # Source
/// Section 5: novel contexts; inference with the grown K^ρ.
pub fn adapt_joint(
    process: &TaskProcess,
    x: MatRef<'_, f64>,
    torques: &[f64],
    how: Adapt,
) -> Result<TaskProcess, TorqueError> {
    let rows = NewRows {
        x,
        torques,
        correlation: 1.0,
    };
    rows.learned_by(process, how)
}

/// One joint's torques of a new context.
struct NewRows<'a> {
    /// (k, 3ℓ).
    x: MatRef<'a, f64>,
    /// (k,), N·m.
    torques: &'a [f64],
    /// Rows that tell as much as one.
    correlation: f64,
}

impl NewRows<'_> {
    fn learned_by(&self, process: &TaskProcess, how: Adapt) -> Result<TaskProcess, TorqueError> {
        let grown = process.with_row(&self.row_of(process, how)?)?;
        if how.is_row_only {
            return Ok(grown);
        }
        let new = grown.covariance().n_tasks() - 1;
        grown.with_correlated_samples(new, self.x, self.torques, self.correlation)
    }

    /// The row of Λ that torques speak for.
    fn row_of(&self, process: &TaskProcess, how: Adapt) -> Result<TaskRow, TorqueError> {
        let latent = LatentFunctions::new(&process.posterior, self.x)?;
        let latent = latent.of_correlated(self.correlation);
        let new = [NewTorques {
            latent: &latent,
            torques: self.torques,
        }];
        let (known, border, options) =
            (process.covariance().task().rows(), Border::InSpan, search());
        let fit = if how.has_prior {
            fit_row_from_population(&new, &known, border, N_NEAREST, &options)?
        } else {
            fit_row(&new, &known, border, N_NEAREST, &options)?
        };
        Ok(fit.row)
    }
}

/// How long to search for a row.
fn search() -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: 1e-4,
        value_tolerance: 1e-8,
        max_evaluations: 200,
        max_recoveries: 5,
    }
}
