//! Learning joint torques under one load: the four models of sec. 3.

use faer::MatRef;
use gp_core::{BayesLinear, FitOptions, GpError, JointModel, LinearForm, TorqueModel, TrainingRanges};
use kernels::TorqueForm;

use crate::commands::fit::report::{self, Line};
use crate::commands::fit::side_by_side::{learn_all, tell_stage};
use crate::commands::fit::{Args, ModelArg, StartsArg, provenance, read_context};
use crate::error::CliError;
use crate::messages;
use crate::samples::DataColumns;
use crate::table::Table;

/// Reads the rows of one context and learns from them; returns the bytes of the model file.
///
/// # Errors
/// Anything wrong with the data, or a joint that cannot be learned.
pub fn learn(
    args: &Args,
    table: Table,
    columns: &DataColumns,
    data_sha256: [u8; 32],
) -> Result<Vec<u8>, CliError> {
    let (file, samples) = read_context(args, table, columns)?;
    let (x, names) = (samples.x.as_ref(), &columns.joints.names);
    let fits = learn_all(&samples.torques, names, &file, args.threads, |job| {
        if matches!(args.model, ModelArg::Gp | ModelArg::Gpc) {
            let (joint, n_samples) = (&names[job.joint_idx], job.values.len());
            tell_stage(joint, n_samples, args.model.name());
        }
        Ok(joint_model(args, x, &job.values)?)
    })?;
    let lines = fits.iter().map(|fit| Line {
        joint: &names[fit.joint_idx],
        model: fit.model.kind().to_string(),
        n_samples: fit.n_samples,
        summary: fit.model.summary(),
        noise_std: fit.model.noise_var().sqrt(),
        seconds: fit.seconds,
    });
    messages::report(report::table(&lines.collect::<Vec<_>>()));

    let provenance = provenance(data_sha256, None, &samples.context);
    let unusable = |cause: GpError| CliError::Usage(format!("{file}: {cause}"));
    let ranges = TrainingRanges::of(x).map_err(unusable)?;
    let learned = fits.into_iter().map(|fit| (fit.joint_idx, fit.model));
    let model = TorqueModel::new(names.clone(), learned.collect(), ranges, provenance);
    Ok(model.map_err(unusable)?.to_bytes())
}

fn joint_model(args: &Args, x: MatRef<'_, f64>, torques: &[f64]) -> Result<JointModel, GpError> {
    let mut options = match args.starts {
        StartsArg::Chapter => FitOptions::chapter(),
        StartsArg::Several => FitOptions::several(),
    };
    options.likelihood.method = args.method.method();
    let process = |form| gp_core::fit(x, torques, form, &options);
    Ok(match args.model {
        ModelArg::Gp => process(TorqueForm::Smooth)?.into(),
        ModelArg::Lrc => BayesLinear::fit(x, torques, LinearForm::Coulomb)?.into(),
        ModelArg::Lr => BayesLinear::fit(x, torques, LinearForm::Smooth)?.into(),
        _ => process(TorqueForm::Coulomb)?.into(),
    })
}
