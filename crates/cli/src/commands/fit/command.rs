//! Reads, checks, learns and writes.

use std::borrow::Cow;
use std::io::Write;
use std::num::NonZeroUsize;

use torque_model::RankSelection;
use torque_model::learn::{Learn, Learned, learn_joints};
use torque_model::{Provenance, RobotModel, Samples, TorqueError};

use crate::commands::fit::args::{Args, ModelArg, RankArg};
use crate::commands::fit::learner::{described_contexts, learner};
use crate::commands::fit::progress::Progress;
use crate::commands::fit::report;
use crate::context::{COLUMN, columns_error};
use crate::context_column::ContextColumn;
use crate::error::CliError;
use crate::few_states::FewStates;
use crate::joints::Joints;
use crate::messages;
use crate::output::{self, Output};
use crate::robot::RobotRequest;
use crate::row_contexts::number_in;
use crate::row_spacing;
use crate::samples::{Data, DataColumns};
use crate::score::is_constant;
use crate::table::Table;

/// Rows of data above which the memory of a fit is worth a word: two matrices of 1 GB.
const MANY_ROWS: usize = 11_000;

/// Rows of data beyond which a process has a low rank, of up to `LARGEST_RANK`, or none at all.
const LARGEST_DENSE: usize = 16_384;
const LARGEST_RANK: usize = 2048;

/// Mean of torques in standard deviations from which they are doubted: at 300 the nMSE of a
/// two-joint arm was 3·10⁻³ instead of 5·10⁻⁶.
const LARGE_OFFSET: f64 = 100.0;

/// Bytes of a fit, roughly: two matrices of order n, or seven with so many columns as the rank.
fn most_bytes(n_rows: usize) -> f64 {
    let entries = if n_rows > LARGEST_DENSE {
        7 * n_rows * LARGEST_RANK
    } else {
        2 * n_rows * n_rows
    };
    8.0 * entries as f64
}

/// Reads the data, learns every joint, writes the model.
///
/// # Errors
/// Anything wrong with the options or the data, or a joint that cannot be learned; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut inputs = args.robot.request().map_or(Vec::new(), RobotRequest::files);
    inputs.push(&args.data.path);
    output::check_not_an_input(&args.output, &inputs)?;
    let mut table = Table::open_hashed(&args.data.path)?;
    let file = table.file().to_owned();
    args.check()?;
    let learner = learner(args)?;
    let (prefix, option, asked) = (&args.data.tau_prefix, "--joints", &args.joints);
    let columns = match joints_of_robot(args, learner.as_ref())? {
        None => DataColumns::of_header(&table, prefix, option, asked),
        Some(joints) => DataColumns::of_robot(&table, joints, prefix, option, asked),
    }?;
    let columns = match args.continuous.named(&columns.joints)? {
        Some(continuous) => columns.with_continuous(&continuous),
        None => columns,
    };
    let mut output = Output::create(&args.output)?;
    let mut data = read(args, &file, &mut table, &columns)?;
    check_bare(args, &file, &data)?;
    check(&file, &data)?;
    if args.model.has_process() {
        let of = (args.continuous).of(&file, &columns.joints, &data.samples);
        data.samples.continuous = of?;
    }
    let learner = match &args.payloads {
        Some(folder) => described_contexts(args, folder, &data.samples.contexts)?,
        None => learner,
    };
    let samples = learned_from(args, &file, &data.samples)?;
    warn_of_memory(&file, samples.n_rows());
    let learned = learn(args, &samples, learner.as_ref(), &file)?;
    let provenance = Provenance {
        data_sha256: table.sha256().unwrap_or_default(),
        robot_sha256: None,
        program: concat!("torque-gp ", env!("CARGO_PKG_VERSION")).to_owned(),
        context: data.context.clone(),
    };
    let model = RobotModel::of_learned(&samples, learner.as_ref(), learned, provenance);
    let model = model.map_err(CliError::of_data(&file))?;
    if args.model == ModelArg::Mgp && args.payloads.is_none() {
        warn_of_few_states(&file, &model, &samples).map_err(CliError::of_data(&file))?;
    }
    let bytes = model.to_bytes();
    let name = output.name().to_owned();
    output
        .write_all(&bytes)
        .map_err(CliError::io("write", name.clone()))?;
    output.commit()?;
    messages::note(format!("{name} written"));
    Ok(())
}

/// The joints of the robot whose parameters are learned, or of the one that says which joints are continuous.
fn joints_of_robot(args: &Args, learner: &dyn Learn) -> Result<Option<Joints>, CliError> {
    let Some(request) = args.robot.request() else {
        return Ok(None);
    };
    let joints = match learner.robot() {
        Some(robot) => Joints::of_robot(&robot.model),
        None => Joints::of_robot(&request.load()?.model),
    };
    // The PUMA 560 has stops, of which its published parameters say nothing.
    Ok(Some(if request.is_built_in() {
        joints.with_stops()
    } else {
        joints
    }))
}

/// The rows of one context, or of several that are learned together.
fn read(
    args: &Args,
    file: &str,
    table: &mut Table,
    columns: &DataColumns,
) -> Result<Data, CliError> {
    let (model, asked) = (args.model.name(), args.data.context.as_deref());
    let header = table.column_names();
    if args.model.is_of_robot() && asked.is_none() && header.iter().any(|name| name == COLUMN) {
        let data = columns.read_all(table, ContextColumn::of_any(file, &header)?)?;
        return Ok(match args.model {
            ModelArg::RbdGp => data.without_only_context(),
            _ => data,
        });
    }
    if !args.model.is_of_many_contexts() {
        return columns.read(table, asked);
    }
    if let Some(context) = asked {
        return Err(CliError::Usage(format!(
            "--context {context}: --model {model} learns all contexts of the data together; leave --context out, or use --model gpc"
        )));
    }
    let contexts = ContextColumn::of_any(file, &header)?;
    let data = columns.read_all(table, contexts)?;
    match (data.samples.contexts.as_slice(), args.rank) {
        ([only], _) => {
            let reason = format!(
                "all rows are of one context (`{only}`); --model {model} is for two or more: use --model gpc"
            );
            Err(columns_error(file, reason))
        }
        (contexts, Some(RankArg::Given(rank))) if rank > contexts.len() => {
            let n_contexts = contexts.len();
            Err(CliError::Usage(format!(
                "--rank {rank}: the rank must be 1 to {n_contexts}, the number of contexts in {file}"
            )))
        }
        _ => Ok(data),
    }
}

/// Refuses contexts of `--bare` that the data does not have.
fn check_bare(args: &Args, file: &str, data: &Data) -> Result<(), CliError> {
    let only = [data.context.clone()];
    let contexts = match data.samples.contexts.as_slice() {
        [] => &only,
        several => several,
    };
    let mut bare = args.bare.iter();
    bare.try_for_each(|name| number_in("--bare", name.trim(), contexts, file).map(|_| ()))
}

/// Refuses data that says nothing, warns of data that is probably not what it seems.
fn check(file: &str, data: &Data) -> Result<(), CliError> {
    let samples = &data.samples;
    let n_rows = samples.n_rows();
    if n_rows < 2 {
        let reason = format!("{n_rows} row of data; at least 2 are needed to learn from");
        return Err(columns_error(file, reason));
    }
    data.warn(file);
    for torques in samples.torques.iter().filter(|t| is_constant(&t.values)) {
        let (joint, value) = (samples.name_of(torques), torques.values[0]);
        messages::warning(format!(
            "{file}: the torque of `{joint}` is {value} N·m in every row: there is nothing to learn but that"
        ));
    }
    for torques in &samples.torques {
        if let Some(part) = offset(&torques.values) {
            let joint = samples.name_of(torques);
            messages::warning(format!(
                "{file}: the torques of `{joint}` have a mean {part:.0} times their standard deviation, which makes what \
                 changes hard to learn: take a constant offset (a sensor that is not tared) off first"
            ));
        }
    }
    for (number, context) in samples.contexts.iter().enumerate() {
        let of_context = samples.context_of.iter().filter(|of| **of == number);
        if of_context.count() == 1 {
            messages::warning(format!(
                "{file}: context `{context}` has one row: it is predicted from the other contexts"
            ));
        }
    }
    Ok(())
}

/// The rows that count for the model.
fn learned_from<'a>(
    args: &Args,
    file: &str,
    samples: &'a Samples,
) -> Result<Cow<'a, Samples>, CliError> {
    if args.takes_all_rows() || args.model == ModelArg::Rbd {
        Ok(Cow::Borrowed(samples))
    } else if args.model.is_linear() {
        row_spacing::tell_of_weights(file, samples, &args.model.name())?;
        Ok(Cow::Borrowed(samples))
    } else {
        row_spacing::of_process(file, samples)
    }
}

fn warn_of_memory(file: &str, n_rows: usize) {
    if n_rows > MANY_ROWS {
        let gigabytes = most_bytes(n_rows) / 1e9;
        messages::warning(format!(
            "{file}: {n_rows} rows: a Gaussian process may take {gigabytes:.0} GB for each joint learned at a time"
        ));
    }
}

/// Warns of contexts in whose rows there are fewer different states than their row of Λ has entries.
fn warn_of_few_states(
    file: &str,
    model: &RobotModel,
    samples: &Samples,
) -> Result<(), TorqueError> {
    for (number, context) in samples.contexts.iter().enumerate() {
        let of_context = |row: &usize| samples.context_of[*row] == number;
        let rows: Vec<usize> = (0..samples.n_rows()).filter(of_context).collect();
        let x = samples.rows(&rows).x;
        if let Some(few) = FewStates::of(model, x.as_ref())? {
            messages::warning(format!("{file}: context `{context}`: {few}"));
        }
    }
    Ok(())
}

/// Mean in standard deviations, if it is so large that a search finds little beside it; `None` too for equal torques.
fn offset(torques: &[f64]) -> Option<f64> {
    if is_constant(torques) {
        return None;
    }
    let n = torques.len() as f64;
    let mean = torques.iter().sum::<f64>() / n;
    let spread = (torques.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / n).sqrt();
    let part = mean.abs() / spread;
    (part > LARGE_OFFSET).then_some(part)
}

/// Learns the joints side by side, and reports on them.
fn learn(
    args: &Args,
    samples: &Samples,
    learner: &dyn Learn,
    file: &str,
) -> Result<Learned, CliError> {
    let n_joints = samples.torques.len();
    let asked = args.threads.or(std::thread::available_parallelism().ok());
    let n_threads = asked.map_or(1, NonZeroUsize::get).min(n_joints);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .map_err(|error| CliError::Usage(format!("cannot start {n_threads} threads: {error}")))?;
    let of_option = (!args.model.is_of_many_contexts()).then(|| args.model.name());
    let progress = Progress::new(of_option, n_joints);
    let learned = pool
        .install(|| learn_joints(samples, learner, &progress))
        .map_err(CliError::of_data(file))?;
    messages::report(report::table(samples, &learned, &progress));
    if let Some(choice) = &learned.terms {
        messages::report(report::terms(samples, choice));
        for joint in report::worse_than_described(samples, choice) {
            messages::note(joint);
        }
    }
    if let Some(RankSelection { criterion, values }) = &learned.selection {
        let values: Vec<String> = values
            .iter()
            .map(|(rank, value)| format!("{rank} {value:.1}"))
            .collect();
        messages::note(format!("{criterion} by rank: {}", values.join(", ")));
    }
    Ok(learned)
}
