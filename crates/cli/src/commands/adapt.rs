//! `torque-gp adapt`: a model of several contexts learns one more from a few of its torques.

use std::io::Write;
use std::path::PathBuf;

use gp_core::optimize::MinimizeOptions;
use gp_core::{Provenance, TrainingRanges};
use mtgp::latent::LatentFunctions;
use mtgp::novel::{Border, NewTorques, fit_row_from_population};
use mtgp::prior::TaskRow;
use mtgp::{ModelParts, MtgpError, MultiTaskModel, TaskProcess};
use sha2::{Digest, Sha256};

use crate::context::{COLUMN, columns_error, listed};
use crate::error::CliError;
use crate::messages;
use crate::model_file::LearnedModel;
use crate::output::{self, Output};
use crate::range_watch::RangeWatch;
use crate::samples::{DataColumns, JointTorques, Samples};
use crate::spread::{rows_of, spread};
use crate::table::{self, Table};
use crate::text_table;

/// Rows that are learned from at most, with the model conditioned on them and without.
const ROWS: usize = 200;
const ROWS_OF_ROW_ONLY: usize = 20;

/// Known rows that a search for the new one sets out from, beside least squares.
const N_NEAREST: usize = 2;

/// Add a context to a model of several, from a few of its measured torques
///
/// DATA has the columns of `torque-gp fit`, with a torque for every joint of the model.
/// In a file with a column `context`, the rows of --context count; in another, all rows do.
///
/// The new context is a new row of Λ, learned for each joint, and the model is conditioned on the rows as on those that
/// it was learned from, which the known contexts profit from, too; hyperparameters stay. It takes seconds whatever the
/// model was learned from, and a dozen rows are often enough; with fewer rows than the rank, the known contexts say
/// what the rows leave open.
/// With --row-only the row of Λ is all that is learned, and the known contexts are predicted exactly as before.
/// Learning all contexts again with `torque-gp fit` is better once there is much data of the new one.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Model file of several contexts
    #[arg(long, value_name = "FILE.tgp")]
    model: PathBuf,

    /// Measured states and torques of the new context; `-` is standard input
    #[arg(long = "data", value_name = "FILE.csv")]
    data: PathBuf,

    /// Name of the new context
    #[arg(long, value_name = "NAME")]
    context: String,

    /// Start of the torque columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    tau_prefix: String,

    /// Learn a row of Λ and nothing else: the known contexts are predicted exactly as before, the new one less well
    #[arg(long)]
    row_only: bool,

    /// Rows that are learned from at most, evenly spread [default: 200, or 20 with --row-only, since more of them on few
    /// trajectories bend the row to what the model gets wrong there]
    #[arg(long, value_name = "ROWS", value_parser = clap::value_parser!(u32).range(1..))]
    rows: Option<u32>,

    /// Model file with the new context
    #[arg(long, value_name = "FILE.tgp")]
    output: PathBuf,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp adapt --model loads.tgp --data new.csv --context c15 --output more.tgp
  torque-gp predict --model more.tgp --context c15 --input states.csv --output torques.csv

Standard error has, per joint, the error of the new model at the rows (RMSE), and that of the known context which
does best there.

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads model and data, writes the grown model.
///
/// # Errors
/// Anything wrong with the options or a file, or a joint that cannot be learned; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    output::check_not_an_input(&args.output, &[&args.data])?;
    let learned = LearnedModel::load(&args.model)?;
    let whose = args.model.display().to_string();
    let model = learned.several(&whose)?;
    require_new(&args.context, model, &whose)?;
    let (file, bytes) = table::read_bytes(&args.data)?;
    let data_sha256: [u8; 32] = Sha256::digest(&bytes).into();
    let table = Table::from_bytes(file.clone(), bytes)?;
    let columns = DataColumns::of_joints(
        &table,
        learned.joints(),
        &args.tau_prefix,
        &learned.learned(),
    )?;
    learned.note_order(&file, &columns.states);
    let has_column = table.column_names().iter().any(|name| name == COLUMN);
    let samples = columns.read(table, has_column.then_some(args.context.as_str()))?;
    warn(&file, &samples, &columns, model);

    let mut output = Output::create(&args.output)?;
    let grown = adapt(args, model, &samples, &file)?;
    let grown = with_origin(&grown, data_sha256, &args.context)
        .map_err(|cause| columns_error(&file, cause.to_string()))?;
    messages::report(report(&grown, &samples, &file)?);
    let name = output.name().to_owned();
    output
        .write_all(&grown.to_bytes())
        .map_err(CliError::io("write", name.clone()))?;
    output.commit()?;
    messages::note(format!(
        "{name} written, with the contexts {}",
        listed(grown.contexts())
    ));
    Ok(())
}

fn require_new(name: &str, model: &MultiTaskModel, whose: &str) -> Result<(), CliError> {
    if name.trim().is_empty() || name.trim() != name {
        return Err(CliError::Usage(format!(
            "--context `{name}`: a name is needed, without blanks around it"
        )));
    }
    if model.contexts().iter().any(|known| known == name) {
        return Err(CliError::Usage(format!(
            "--context {name}: {whose} has it already; it has {}",
            listed(model.contexts())
        )));
    }
    Ok(())
}

fn warn(file: &str, samples: &Samples, columns: &DataColumns, model: &MultiTaskModel) {
    for doubt in &samples.doubts {
        messages::warning(format!("{file}: {doubt}"));
    }
    let mut ranges = RangeWatch::new(model.ranges());
    for row in 0..samples.x.nrows() {
        ranges.see(&samples.x.row(row).iter().copied().collect::<Vec<f64>>());
    }
    let doubt = ranges.doubt(file, &columns.states.states);
    doubt.into_iter().for_each(messages::warning);
    let rank = model
        .learned()
        .iter()
        .map(|(_, process)| process.covariance().task().rank())
        .max();
    let (n_rows, rank) = (samples.x.nrows(), rank.unwrap_or_default());
    if n_rows < rank {
        messages::warning(format!(
            "{file}: {n_rows} rows for a model of rank {rank}: the known contexts say what they leave open"
        ));
    }
}

/// Learns the rows of all joints, and unless they are all that is asked for conditions on the torques.
fn adapt(
    args: &Args,
    model: &MultiTaskModel,
    samples: &Samples,
    file: &str,
) -> Result<MultiTaskModel, CliError> {
    let most = match (args.rows, args.row_only) {
        (Some(rows), _) => rows as usize,
        (None, false) => ROWS,
        (None, true) => ROWS_OF_ROW_ONLY,
    };
    let places = spread(samples.x.nrows(), most);
    let x = rows_of(samples.x.as_ref(), &places);
    let torques_of = |joint: &JointTorques| -> Vec<f64> {
        places.iter().map(|&row| joint.values[row]).collect()
    };
    let row_of = |(process, joint): (&TaskProcess, &JointTorques)| -> Result<TaskRow, MtgpError> {
        let torques = torques_of(joint);
        let latent = LatentFunctions::new(&process.posterior, x.as_ref())?;
        let new = NewTorques {
            latent: &latent,
            torques: &torques,
        };
        let known = process.covariance().task().rows();
        let fit = fit_row_from_population(&[new], &known, Border::InSpan, N_NEAREST, &search())?;
        Ok(fit.row)
    };
    let mut rows = Vec::new();
    for ((joint_idx, process), joint) in model.learned().iter().zip(&samples.torques) {
        let row = row_of((process, joint)).map_err(|cause| CliError::Joint {
            file: file.to_owned(),
            joint: model.joint_names()[*joint_idx].clone(),
            cause: Box::new(cause),
        })?;
        rows.push(row);
    }
    let unusable = |cause: MtgpError| columns_error(file, cause.to_string());
    let ranges = TrainingRanges::of(samples.x.as_ref()).map_err(|cause| unusable(cause.into()))?;
    let grown = model
        .with_context(&args.context, &rows, ranges)
        .map_err(unusable)?;
    if args.row_only {
        return Ok(grown);
    }
    let torques: Vec<Vec<f64>> = samples.torques.iter().map(torques_of).collect();
    grown
        .with_samples(&args.context, x.as_ref(), &torques)
        .map_err(unusable)
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

/// The grown model, whose data are those of the old one and the new ones.
fn with_origin(
    model: &MultiTaskModel,
    data_sha256: [u8; 32],
    context: &str,
) -> Result<MultiTaskModel, gp_core::GpError> {
    let old = model.provenance();
    let both = Sha256::new()
        .chain_update(old.data_sha256)
        .chain_update(data_sha256);
    MultiTaskModel::new(ModelParts {
        provenance: Provenance {
            data_sha256: both.finalize().into(),
            robot_sha256: old.robot_sha256,
            program: format!(
                "torque-gp {} (`{context}` added)",
                env!("CARGO_PKG_VERSION")
            ),
            context: old.context.clone(),
        },
        ..model.parts().clone()
    })
}

/// Errors at the rows: of the new context, and of the known one that does best.
fn report(model: &MultiTaskModel, samples: &Samples, file: &str) -> Result<String, CliError> {
    let new = model.contexts().len() - 1;
    let mut lines = Vec::new();
    for ((joint_idx, process), joint) in model.learned().iter().zip(&samples.torques) {
        let error_of = |task| {
            let rows = process.covariance().rows_of(samples.x.as_ref(), task)?;
            let mean = process.posterior.predict_mean(rows.as_ref())?;
            Ok(root_mean_square(&mean, &joint.values))
        };
        let errors: Result<Vec<f64>, MtgpError> = (0..=new).map(error_of).collect();
        let errors = errors.map_err(|cause| columns_error(file, cause.to_string()))?;
        let mut best = 0;
        for task in 0..new {
            if errors[task] < errors[best] {
                best = task;
            }
        }
        lines.push(vec![
            model.joint_names()[*joint_idx].clone(),
            format!("{:.4e}", errors[new]),
            model.contexts()[best].clone(),
            format!("{:.4e}", errors[best]),
        ]);
    }
    let header = ["joint", "RMSE (N·m)", "best known", "its RMSE (N·m)"];
    Ok(text_table::render(&header, &lines))
}

fn root_mean_square(mean: &[f64], torques: &[f64]) -> f64 {
    let squares: f64 = mean.iter().zip(torques).map(|(m, t)| (m - t).powi(2)).sum();
    (squares / torques.len() as f64).sqrt()
}
