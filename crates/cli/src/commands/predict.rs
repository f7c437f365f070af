//! `torque-gp predict`: a CSV of states in, a CSV of learned torques and their uncertainty out.

use std::path::PathBuf;

use faer::MatRef;

use crate::columns::StateColumns;
use crate::degrees::DegreesWatch;
use crate::error::CliError;
use crate::memory_rows::MemoryRows;
use crate::messages;
use crate::model_file::ModelFile;
use crate::output::{self, Output};
use crate::range_watch::RangeWatch;
use crate::result_table::{self, ResultTable};
use crate::row_contexts::RowContexts;
use crate::table::{Row, Table};

/// Rows predicted together.
const BLOCK: usize = 1024;

/// Torques of a learned model, mean and standard deviation, for every row of a CSV of states
///
/// INPUT has a header with q1..qN, qd1..qdN, qdd1..qddN (or q_<joint>, qd_<joint>, qdd_<joint>), in any column
/// order, and one row per sample; other columns are copied to the output as they are.
/// OUTPUT has those columns, then tau1, tau1_std, … (or tau_<joint>, tau_<joint>_std) of every learned joint,
/// in N·m, one row per input row, in digits that read back exactly.
///
/// The standard deviation is that of the torque itself (latent); --observed adds the noise of a measurement.
/// A warning counts the rows outside the range of the training data.
/// A model whose friction remembers (rbd) needs the column t, and takes the rows in their order: as one motion, or
/// as one for each entry of a column run; or columns of the states themselves (z0.5_1, …).
/// A model of several contexts predicts each row in the one of its column `context`, or all in that of --context.
/// With --payload all rows are predicted for a load that need not have been carried, by its mass and centre: with models
/// of `fit --payloads`, and with rbd.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Model file of `torque-gp fit`
    #[arg(long, value_name = "FILE.tgp")]
    model: PathBuf,

    /// States; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    input: PathBuf,

    /// Context in which all rows are predicted [default: each row's entry in the column `context`]; for models of
    /// several contexts
    #[arg(long, value_name = "NAME")]
    context: Option<String>,

    /// Load that is carried in all rows, by its data sheet: mass, centre, and inertia or size (see
    /// `inverse-dynamics --help`); for models of `fit --payloads` and rbd
    #[arg(long, value_name = "FILE.toml", conflicts_with = "context")]
    payload: Option<PathBuf>,

    /// Torques; `-` is standard output
    #[arg(long, value_name = "FILE.csv")]
    output: PathBuf,

    /// Standard deviations of the noise-free torque (the default)
    #[arg(long, conflicts_with = "observed")]
    latent: bool,

    /// Standard deviations of a new measurement: those of the torque, and the noise
    #[arg(long)]
    observed: bool,

    /// Copy the state columns to the output as well
    #[arg(long)]
    keep_states: bool,

    /// Start of the result columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    tau_prefix: String,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp predict --model model.tgp --input states.csv --output torques.csv
  torque-gp predict --model model.tgp --input test.csv --tau-prefix model_tau --observed --output compared.csv
  torque-gp predict --model mgp.tgp --context c7 --input states.csv --output torques.csv
  torque-gp predict --model mgp.tgp --payload new.toml --input states.csv --output torques.csv
  cat states.csv | torque-gp predict --model model.tgp --input - --output -

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads the states, writes the predictions.
///
/// # Errors
/// Anything wrong with the options or a file; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut inputs = vec![args.model.as_path(), &args.input];
    inputs.extend(args.payload.as_deref());
    output::check_not_an_input(&args.output, &inputs)?;
    let (model, loaded) = ModelFile::load(&args.model)?.with_payload(args.payload.as_deref())?;
    let table = Table::open(&args.input)?;
    let file = table.file().to_owned();
    let joints = model.joints();
    let columns = StateColumns::find(&file, &table.column_names(), &joints)?;
    model.note_order(&file, &columns);
    let contexts = match loaded {
        Some(number) => RowContexts::Same(number),
        None => RowContexts::new(&model, &table, args.context.as_deref())?,
    };
    let names = columns
        .naming
        .columns(&args.tau_prefix, model.joint_names());
    let added = model.learned_joints().into_iter().flat_map(|joint_idx| {
        let name = &names[joint_idx];
        [name.clone(), format!("{name}_std")]
    });
    let mut job = Job {
        result: ResultTable::new(&table, &columns, args.keep_states, added.collect())?,
        ranges: RangeWatch::new(model.ranges()),
        degrees: DegreesWatch::without_limits(&columns.states[..model.n_joints()], &joints),
        contexts,
        model: &model,
        columns: &columns,
        is_observed: args.observed,
        memory: MemoryRows::new(&model, &table)?,
        states: Vec::new(),
        numbers: Vec::new(),
        copied: Vec::new(),
        n_predicted: 0,
    };
    let mut output = Output::create(&args.output)?;
    job.convert(table, &mut output)?;

    job.degrees.doubts().into_iter().for_each(messages::warning);
    job.ranges.warn(&file, &columns.states);
    let (name, n_rows) = (output.name().to_owned(), job.n_predicted);
    output.commit()?;
    let kind = if args.observed {
        "with the noise of a measurement"
    } else {
        "of the noise-free torque"
    };
    messages::note(format!(
        "{n_rows} rows written to {name} (standard deviations {kind})"
    ));
    Ok(())
}

/// Everything that a block of rows needs.
struct Job<'a> {
    model: &'a ModelFile,
    contexts: RowContexts,
    columns: &'a StateColumns,
    result: ResultTable,
    ranges: RangeWatch<'a>,
    degrees: DegreesWatch,
    is_observed: bool,
    /// What hysteresis the rows have.
    memory: MemoryRows,
    /// States of the block, row-major.
    states: Vec<f64>,
    /// Numbers of the contexts of the block's rows.
    numbers: Vec<usize>,
    /// Copied fields of each row of the block.
    copied: Vec<Vec<String>>,
    n_predicted: usize,
}

impl Job<'_> {
    fn convert(&mut self, mut table: Table, output: &mut Output) -> Result<(), CliError> {
        self.result.write_header(output)?;
        let file = table.file().to_owned();
        while let Some(row) = table.next_row()? {
            self.take(row)?;
            if self.copied.len() == BLOCK {
                self.write_block(&file, output)?;
            }
        }
        self.write_block(&file, output)
    }

    fn take(&mut self, row: Row<'_>) -> Result<(), CliError> {
        self.numbers.push(self.contexts.take(row)?);
        let first = self.states.len();
        for column in &self.columns.states {
            self.states.push(row.number(column)?);
        }
        let x = &self.states[first..];
        let n_joints = self.model.n_joints();
        self.degrees.see(&x[..n_joints]);
        self.ranges.see(x);
        let context = self.numbers.last().copied().unwrap_or_default();
        let z = self.memory.take(row, context, &x[n_joints..2 * n_joints])?;
        self.states.extend_from_slice(z);
        let copied = self.result.copied_fields(row).map(str::to_owned);
        self.copied.push(copied.collect());
        Ok(())
    }

    /// Predicts and writes the block, and empties it.
    fn write_block(&mut self, file: &str, output: &mut Output) -> Result<(), CliError> {
        let (n_rows, n_covariates) = (self.copied.len(), self.model.n_covariates());
        let x = MatRef::from_row_major_slice(&self.states, n_rows, n_covariates);
        let predictions = (self.model).predict_rows(&self.numbers, x, file, self.n_predicted)?;
        let mut numbers = Vec::with_capacity(2 * predictions.len());
        for (row, copied) in self.copied.iter().enumerate() {
            numbers.clear();
            for joint in &predictions {
                let noise_var = if self.is_observed {
                    joint.noise_var[row]
                } else {
                    0.0
                };
                numbers.extend([joint.mean[row], (joint.var[row] + noise_var).sqrt()]);
            }
            result_table::write_row(copied.iter().map(String::as_str), numbers.iter(), output)
                .map_err(CliError::io("write", output.name()))?;
        }
        self.n_predicted += n_rows;
        self.states.clear();
        self.numbers.clear();
        self.copied.clear();
        Ok(())
    }
}
