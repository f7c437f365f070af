//! `torque-gp adapt`: a model of several contexts learns one more from a few of its torques.

use std::io::Write;
use std::path::PathBuf;

use torque_model::rigid_body::ParameterPosterior;
use torque_model::{Adapt, JointTorques, RobotModel, Samples, TorqueError};

use crate::body_table::body_rows;
use crate::context::{COLUMN, listed};
use crate::error::CliError;
use crate::few_states::FewStates;
use crate::messages;
use crate::model_file::ModelFile;
use crate::output::{self, Output};
use crate::range_watch::warn_outside;
use crate::row_spacing;
use crate::samples::{Data, DataColumns};
use crate::table::Table;
use crate::text_table;

/// Add a context to a model of several, from a few of its measured torques
///
/// DATA has the columns of `torque-gp fit`, with a torque for every joint of the model.
/// In a file with a column `context`, the rows of --context count; in another, all rows do.
///
/// The new context is a new row of Λ, learned for each joint, and the model is conditioned on the rows as on those that
/// it was learned from, which the known contexts profit from, too; hyperparameters stay. It takes seconds whatever the
/// model was learned from, and a dozen rows of different states are often enough; with fewer of them than the rank, the
/// known contexts say what the rows leave open. Many rows of an arm at rest are one state.
/// Rows closer in time than 0.3 s, by the column `t`, share what the model does not know: those of 0.3 s count as one.
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
    let model = ModelFile::load(&args.model)?;
    let model = match model.rigid_body() {
        Some(_) => model,
        None => model.of_several()?,
    };
    require_new(&args.context, &model)?;
    let mut table = Table::open_hashed(&args.data)?;
    let file = table.file().to_owned();
    let version = env!("CARGO_PKG_VERSION");
    let program = format!("torque-gp {version} (`{}` added)", args.context);
    let (prefix, learned) = (&args.tau_prefix, model.learned_joints());
    let columns = DataColumns::of_joints(&table, model.joints(), prefix, &learned)?;
    model.note_order(&file, &columns.states);
    let has_column = table.column_names().iter().any(|name| name == COLUMN);
    let data = columns.read(&mut table, has_column.then_some(args.context.as_str()))?;
    let data_sha256 = table.sha256().unwrap_or_default();
    let provenance = (model.provenance()).with_data(&program, data_sha256);
    warn(&file, &data, &columns, &model).map_err(CliError::of_data(&file))?;

    let mut output = Output::create(&args.output)?;
    let how = Adapt {
        is_row_only: args.row_only,
        most_rows: args.rows.map(|rows| rows as usize),
        ..Adapt::default()
    };
    let grown = torque_model::adapt(&model, &args.context, &data.samples, how, provenance)
        .map_err(CliError::of_data(&file))?;
    if model.rigid_body().is_none() {
        row_spacing::tell_of_new_rows(&file, &data.samples)?;
    }
    messages::report(
        report(&grown, &args.context, &data.samples).map_err(CliError::of_data(&file))?,
    );
    if let Some(posterior) = grown.rigid_body() {
        let context = grown.number_of(&args.context);
        let context = context.map_err(CliError::of_data(&file))?;
        if let Some(load) = posterior.load_of(context) {
            messages::report(load_table(posterior, load));
        }
    }
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

fn require_new(name: &str, model: &ModelFile) -> Result<(), CliError> {
    if name.trim().is_empty() || name.trim() != name {
        return Err(CliError::Usage(format!(
            "--context `{name}`: a name is needed, without blanks around it"
        )));
    }
    if model.rigid_body().is_none() && model.contexts().iter().any(|known| known == name) {
        return Err(CliError::Usage(format!(
            "--context {name}: {} has it already; it has {}",
            model.file,
            listed(model.contexts())
        )));
    }
    Ok(())
}

fn warn(
    file: &str,
    data: &Data,
    columns: &DataColumns,
    model: &ModelFile,
) -> Result<(), TorqueError> {
    data.warn(file);
    let x = data.samples.x.as_ref();
    warn_outside(model.ranges(), x, file, &columns.states.states);
    if model.rigid_body().is_some() {
        return Ok(());
    }
    let ranks = model.tasks().map(|(_, of)| of.covariance().task().rank());
    let (n_rows, rank) = (x.nrows(), ranks.max().unwrap_or_default());
    if n_rows < rank {
        messages::warning(format!(
            "{file}: {n_rows} rows for a model of rank {rank}: the known contexts say what they leave open"
        ));
    } else if let Some(few) = FewStates::of(model, x)? {
        messages::warning(format!("{file}: {few}"));
    }
    Ok(())
}

/// The ten parameters of a load with their standard deviations.
fn load_table(posterior: &ParameterPosterior, load: usize) -> String {
    let rows = body_rows(posterior, posterior.unknowns().load(load));
    text_table::render(&["load", "value", "± one std", "unit"], &rows)
}

/// Errors at the rows: of the new context, and of the known one that does best.
fn report(model: &RobotModel, name: &str, samples: &Samples) -> Result<String, TorqueError> {
    let new = model.number_of(name)?;
    let others: Vec<usize> = (0..model.contexts().len())
        .filter(|of| *of != new)
        .collect();
    let x = model.states_of(samples)?;
    let mut lines = Vec::new();
    for ((_, joint_model), joint) in model.learned().iter().zip(&samples.torques) {
        let error_of = |context| {
            let function = joint_model.function();
            let mean = function.predict_mean(context, (*x).as_ref())?;
            Ok::<f64, TorqueError>(root_mean_square(&mean, joint))
        };
        let mut best: Option<(usize, f64)> = None;
        for other in &others {
            let error = error_of(*other)?;
            if best.is_none_or(|(_, least)| error < least) {
                best = Some((*other, error));
            }
        }
        lines.push(vec![
            samples.name_of(joint).to_owned(),
            format!("{:.4e}", error_of(new)?),
            best.map_or("-".to_owned(), |(of, _)| model.contexts()[of].clone()),
            best.map_or("-".to_owned(), |(_, error)| format!("{error:.4e}")),
        ]);
    }
    let header = ["joint", "RMSE (N·m)", "best known", "its RMSE (N·m)"];
    Ok(text_table::render(&header, &lines))
}

fn root_mean_square(mean: &[f64], joint: &JointTorques) -> f64 {
    let errors = mean.iter().zip(&joint.values);
    let squares: f64 = errors.map(|(m, t)| (m - t).powi(2)).sum();
    (squares / joint.values.len() as f64).sqrt()
}
