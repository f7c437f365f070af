//! Learning joint torques with the robot's description as prior: sec. 3.2.

use faer::{Mat, MatRef};
use gp_core::{FitOptions, GpError, InformedModel, Starts, TrainingRanges};
use gp_core::fit::{ParameterPrior, RegressorSamples, fit_rigid_body, fit_rigid_body_and_process};
use kernels::TorqueForm;
use puma_dyn::dynamics::{
    N_DRIVE_PARAMETERS, N_PARAMETERS, ParameterSpread, drive_parameters, inertial_parameters,
};
use puma_dyn::{Context, Effects, Friction};

use crate::commands::fit::report::{self, Line};
use crate::commands::fit::side_by_side::learn_all;
use crate::commands::fit::{Args, ModelArg, StartsArg, provenance, read_context};
use crate::error::CliError;
use crate::messages;
use crate::rigid_body_model::RigidBodyModel;
use crate::robot::Robot;
use crate::robot_source::{RobotSource, regressors};
use crate::samples::{DataColumns, JointTorques};
use crate::table::Table;

/// Torque of a drive parameter that the description does not state, one standard deviation, as a part of the
/// joint's torques: both root mean squares.
const UNSTATED_PART: f64 = 0.1;

/// Reads the rows of one context and learns from them; returns the bytes of the model file.
///
/// # Errors
/// Anything wrong with the data, or a joint that cannot be learned.
pub fn learn(
    args: &Args,
    source: RobotSource,
    robot: &Robot,
    table: Table,
    columns: &DataColumns,
    data_sha256: [u8; 32],
) -> Result<Vec<u8>, CliError> {
    let (file, samples) = read_context(args, table, columns)?;
    let (x, names) = (samples.x.as_ref(), &columns.joints.names);
    let nominal = nominal_prior(robot);
    let fits = learn_all(&samples.torques, names, &file, args.threads, |job| {
        Ok(joint_model(args, robot, &nominal, x, job)?)
    })?;
    let lines = fits.iter().map(|fit| Line {
        joint: &names[fit.joint_idx],
        model: fit.model.name().to_owned(),
        n_samples: fit.n_samples,
        summary: Some(fit.model.summary()),
        noise_std: fit.model.noise_std(),
        seconds: fit.seconds,
    });
    messages::report(report::table(&lines.collect::<Vec<_>>()));

    let provenance = provenance(data_sha256, Some(source.sha256()), &samples.context);
    let unusable = |cause: GpError| CliError::Usage(format!("{file}: {cause}"));
    let ranges = TrainingRanges::of(x).map_err(unusable)?;
    let learned = fits.into_iter().map(|fit| (fit.joint_idx, fit.model));
    let (learned, model) = (learned.collect(), robot.model.clone());
    Ok(RigidBodyModel::new(source, model, learned, ranges, provenance).to_bytes())
}

/// The description's values with their usual uncertainty, and an unknown load behind the last joint.
fn nominal_prior(robot: &Robot) -> ParameterPrior {
    let mut mean = inertial_parameters(&robot.model, &Context::empty());
    mean.extend(drive_parameters(&robot.model, robot.effects));
    let std = ParameterSpread::default().std_with_load(&mean);
    ParameterPrior { mean, std }
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

fn joint_model(
    args: &Args,
    robot: &Robot,
    nominal: &ParameterPrior,
    x: MatRef<'_, f64>,
    job: &JointTorques,
) -> Result<InformedModel, GpError> {
    let regressor: Mat<f64> = regressors(&robot.model, &[job.joint_idx], x).remove(0);
    let (y, targets) = (regressor.as_ref(), job.values.as_slice());
    let mut prior = nominal.clone();
    allow_for_unstated_drive(&mut prior, robot.effects, job.joint_idx, y, targets);
    let samples = RegressorSamples {
        x,
        regressor: y,
        targets,
    };
    let mut options = FitOptions {
        starts: match args.starts {
            StartsArg::Chapter => Starts::Chapter,
            StartsArg::Several => Starts::Several,
        },
        ..FitOptions::several()
    };
    options.likelihood.method = args.method.method();
    Ok(if args.model == ModelArg::Rbd {
        fit_rigid_body(samples, &prior, &options)?.into()
    } else {
        let form = TorqueForm::Coulomb;
        fit_rigid_body_and_process(samples, &prior, form, &options)?.into()
    })
}
