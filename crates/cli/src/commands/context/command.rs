//! Reads, asks which context it is row after row and in total, and writes.

use std::io::Write;
use std::path::{Path, PathBuf};

use mtgp::context::{
    Calibration, ContextAnswer, ContextEvidence, ContextPosterior, ContextPrior, ContextTracker,
    ContextTransition, known_or_unknown,
};
use serde::Serialize;
use torque_model::rigid_body::LEAST_SECONDS;
use torque_model::{RobotModel, Samples, TorqueError};

use crate::commands::context::evidence::evidence_of;
use crate::commands::context::held_out::Trials;
use crate::commands::context::loads::Loads;
use crate::commands::context::online::{Following, How};
use crate::context::columns_error;
use crate::context_prior::PriorArg;
use crate::error::CliError;
use crate::messages;
use crate::model_file::ModelFile;
use crate::output::{self, Output};
use crate::printed::PrintArgs;
use crate::range_watch::warn_outside;
use crate::row_spacing;
use crate::samples::DataColumns;
use crate::table::Table;
use crate::text_table;

/// Which context measured torques come from: probabilities row after row and in total
///
/// DATA has the columns of `torque-gp fit`, in the order of time, with a torque for every joint of the model; a column
/// `context` is ignored.
/// The total takes all rows to be of one context, with the covariance between them; of more than --rows rows, as many
/// are taken, evenly spread.
/// Row after row, what is believed after a row takes the rows before it into account, with --switching as contexts
/// that change.
/// Rows closer in time than 0.3 s, by the column `t`, share what the model does not know: those of 0.3 s count as one.
/// "None of these" is the answer if, under every context, torques this far from the model's are less probable than
/// --level; a model's own variance is often too small where it has no samples, and then it says so too soon.
/// Of a model of a robot's parameters (rbd), all rows are one stretch, with the evidence of each known load and of one
/// that is not known; the answer is the most probable of these.
/// With --online they are rows of a loop: a load that is picked up or put down is noticed, and weighed with an error
/// bar that shrinks with every row, without knowing it beforehand.
/// With --held-out, p-values are ranks among trials of known contexts instead: then it says so no more often than
/// --level of the time, if motions and rows are like theirs.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Model file of several contexts
    #[arg(long, value_name = "FILE.tgp")]
    model: PathBuf,

    /// Measured states and torques; `-` is standard input
    #[arg(long = "data", value_name = "FILE.csv")]
    data: PathBuf,

    /// Start of the torque columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    tau_prefix: String,

    /// Weights of the contexts before the data, as c1=2,c2=1; a context that is left out has none [default: all alike]
    #[arg(long, value_name = "WEIGHTS")]
    prior: Option<PriorArg>,

    /// Changes of context per second, row after row [default: none]
    #[arg(long, value_name = "RATE", value_parser = not_negative)]
    switching: Option<f64>,

    /// Seconds between rows, for --switching [default: from the column `t`]
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, requires = "switching")]
    interval: Option<f64>,

    /// Rows before each one whose covariance with it counts, row after row
    #[arg(long, value_name = "ROWS", default_value_t = 10)]
    window: usize,

    /// Standard deviation of noise of these torques beyond that of the training data, N·m
    #[arg(long, value_name = "STD", default_value_t = 0.0, value_parser = not_negative)]
    noise: f64,

    /// Torques of known contexts that the model was not learned from, by the column `context`; each stretch of as many
    /// rows as DATA has is a trial
    #[arg(long, value_name = "FILE.csv")]
    held_out: Option<PathBuf>,

    /// Level below which torques are too improbable for a context
    #[arg(long, value_name = "LEVEL", default_value_t = 0.05, value_parser = probability)]
    level: f64,

    /// Rows that the total takes at most
    #[arg(long, value_name = "ROWS", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    rows: u32,

    /// Follow the load row after row, of a model of a robot's parameters (rbd): probabilities, mass and its standard
    /// deviation, changes; needs a column `t`
    #[arg(long)]
    online: bool,

    /// Seconds between the rows that are shown of --online [default: every row]
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, requires = "online")]
    every: Option<f64>,

    /// Seconds after which a row tells e times less of a load of --online [default: 10]
    #[arg(long, value_name = "SECONDS", value_parser = not_negative, requires = "online")]
    forgetting: Option<f64>,

    /// Probabilities row after row, p_<context> beside the most probable one; of --online t, p_<context>, p_unknown,
    /// mass, mass_std (kg), changes, and since when (s); `-` is standard output
    #[arg(long, value_name = "FILE.csv")]
    output: Option<PathBuf>,

    #[command(flatten)]
    print: PrintArgs,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp context --model loads.tgp --data log.csv
  torque-gp context --model loads.tgp --data log.csv --prior c1=3,c2=1 --json
  torque-gp context --model loads.tgp --data log.csv --held-out held_out.csv
  torque-gp context --model loads.tgp --data log.csv --switching 0.2 --noise 0.05 --output which.csv
  torque-gp context --model arm.tgp --data log.csv --online --every 0.5

JSON: {\"answer\": \"c3\" or null, \"n_rows\": …, \"n_in_total\": …, \"contexts\": [{\"context\": \"c1\",
\"log_density\": …, \"probability\": …, \"p_value\": …}, …], \"rows\": [{\"context\": \"c3\",
\"probabilities\": […]}, …]}.
JSON of rbd: {\"answer\": \"c3\" or null, \"n_rows\": …, \"contexts\": [{\"context\": …, \"log_evidence\": …,
\"probability\": …}, …], \"unknown\": {\"log_evidence\": …, \"probability\": …}}.
JSON of --online: {\"answer\": \"c3\" or null, \"n_rows\": …, \"changes\": …, \"contexts\": [\"c1\", …], \"rows\":
[{\"t\": …, \"probabilities\": […], \"unknown\": …, \"mass\": …, \"mass_std\": …, \"changes\": …, \"since\": …}, …]}.

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

impl Args {
    /// Refuses what a model of a robot's parameters has no use for.
    ///
    /// # Errors
    /// Which option.
    fn require_evidence_alone(&self) -> Result<(), CliError> {
        let asked = [
            ("--prior", self.prior.is_some()),
            ("--switching", self.switching.is_some()),
            ("--held-out", self.held_out.is_some()),
            ("--output", self.output.is_some() && !self.online),
            ("--noise", self.noise > 0.0),
        ];
        let Some((option, _)) = asked.into_iter().find(|(_, is_asked)| *is_asked) else {
            return Ok(());
        };
        Err(CliError::Usage(format!(
            "{option} is for models of several processes (mgp, igp, pgp), not for rbd"
        )))
    }
}

/// What is written as JSON.
#[derive(Serialize)]
struct Estimate {
    /// `None`: none of these.
    answer: Option<String>,
    n_rows: usize,
    /// Rows that the total is of.
    n_in_total: usize,
    contexts: Vec<OfContext>,
    rows: Vec<OfRow>,
}

#[derive(Serialize)]
struct OfContext {
    context: String,
    /// log p of all torques of the total, nat.
    log_density: f64,
    probability: f64,
    p_value: f64,
}

#[derive(Serialize)]
struct OfRow {
    /// The most probable one.
    context: String,
    probabilities: Vec<f64>,
}

/// Reads the data, prints the probabilities.
///
/// # Errors
/// Anything wrong with the options or a file; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    if let Some(output) = &args.output {
        output::check_not_an_input(output, &[&args.model, &args.data])?;
    }
    let model = model_of(args)?;
    let mut table = Table::open(&args.data)?;
    let file = table.file().to_owned();
    let (prefix, learned) = (&args.tau_prefix, model.learned_joints());
    let columns = DataColumns::of_joints(&table, model.joints(), prefix, &learned)?;
    model.note_order(&file, &columns.states);
    let data = columns.read_as_one(&mut table)?;
    data.warn(&file);
    let samples = &data.samples;
    let x = samples.x.as_ref();
    warn_outside(model.ranges(), x, &file, &columns.states.states);
    if args.online {
        return follow_load(args, &model, samples, &file);
    }
    if let Some(posterior) = model.rigid_body() {
        let loads = Loads::of(posterior, samples).map_err(CliError::of_data(&file))?;
        return args.print.print(&loads, Loads::table);
    }

    let (contexts, n_rows) = (model.contexts(), samples.n_rows());
    let prior = match &args.prior {
        Some(prior) => prior.of(contexts, &model.file)?,
        None => ContextPrior::uniform(contexts.len()).map_err(CliError::of_data(&file))?,
    };
    let interval = args
        .switching
        .map(|_| interval(args, &file, &data.samples.timeline.t))
        .transpose()?;
    let in_total = samples.spread(args.rows as usize);
    let trials = Trials {
        model: &model,
        tau_prefix: prefix,
        noise: args.noise,
        n_rows,
        n_in_total: in_total.n_rows(),
        level: args.level,
    };
    let held_out = args.held_out.as_ref();
    let calibration = held_out.map(|path| trials.calibration(path)).transpose()?;
    let total = Total::new(args, &model, &in_total, &prior, calibration.as_ref());
    let total = total.map_err(CliError::of_data(&file))?;
    let rows = follow(args, &model, samples, &prior, interval).map_err(CliError::of_data(&file))?;
    row_spacing::tell_of_new_rows(&file, samples)?;
    if let Some(path) = &args.output {
        write_rows(path, contexts, &rows)?;
    }
    let estimate = total.estimate(contexts, n_rows, rows);
    args.print.print(&estimate, Estimate::table)
}

/// A model of a robot's parameters, or of several contexts.
fn model_of(args: &Args) -> Result<ModelFile, CliError> {
    let model = ModelFile::load(&args.model)?;
    if model.rigid_body().is_some() {
        args.require_evidence_alone()?;
        return Ok(model);
    }
    if args.online {
        let reason = "--online is for models of a robot's parameters (rbd)".to_owned();
        return Err(CliError::Usage(reason));
    }
    model.of_several()
}

/// The load that rbd sees, row after row.
fn follow_load(
    args: &Args,
    model: &RobotModel,
    samples: &Samples,
    file: &str,
) -> Result<(), CliError> {
    let (every, forgetting) = (args.every, args.forgetting);
    if forgetting.is_some_and(|seconds| seconds <= 0.0) {
        let reason = "--forgetting: seconds above zero are needed".to_owned();
        return Err(CliError::Usage(reason));
    }
    let following = Following::of(model, samples, file, How { every, forgetting })?;
    if let Some(path) = &args.output {
        write_records(path, following.header(), following.records())?;
    }
    args.print.print(&following, Following::table)
}

/// Seconds between rows: what was asked for, or the mean difference of the times.
fn interval(args: &Args, file: &str, times: &[f64]) -> Result<f64, CliError> {
    if let Some(interval) = args.interval {
        return Ok(interval);
    }
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        let reason = "--switching: there is no column `t` with the rows' times in seconds; \
                      say --interval SECONDS";
        return Err(columns_error(file, reason.to_owned()));
    };
    if let Some(row) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        let reason = format!("row {}, column `t`: time does not go on", row + 2);
        return Err(columns_error(file, reason));
    }
    Ok((last - first) / (times.len().max(2) - 1) as f64)
}

/// Eq. (21) for some rows together.
struct Total {
    evidence: ContextEvidence,
    posterior: ContextPosterior,
    p_values: Vec<f64>,
    answer: ContextAnswer,
    n_rows: usize,
}

impl Total {
    fn new(
        args: &Args,
        model: &RobotModel,
        samples: &Samples,
        prior: &ContextPrior,
        calibration: Option<&Calibration>,
    ) -> Result<Self, TorqueError> {
        let evidence = evidence_of(model, samples, args.noise)?;
        let posterior = evidence.posterior(prior)?;
        let p_values = match calibration {
            None => evidence.p_values(),
            Some(calibration) => {
                let scores = evidence.scores().into_iter();
                scores.map(|score| calibration.p_value(score)).collect()
            }
        };
        Ok(Self {
            answer: known_or_unknown(&posterior, &p_values, args.level)?,
            evidence,
            posterior,
            p_values,
            n_rows: samples.n_rows(),
        })
    }

    fn estimate(self, contexts: &[String], n_rows: usize, rows: Vec<Vec<f64>>) -> Estimate {
        let answer = match self.answer {
            ContextAnswer::Known { context, .. } => Some(contexts[context].clone()),
            ContextAnswer::Unknown { .. } => None,
        };
        let probabilities = self.posterior.probabilities();
        let of_context = |(idx, context): (usize, &String)| OfContext {
            context: context.clone(),
            log_density: self.evidence.log_densities()[idx],
            probability: probabilities[idx],
            p_value: self.p_values[idx],
        };
        let of_row = |probabilities: Vec<f64>| OfRow {
            context: contexts[most_probable(&probabilities)].clone(),
            probabilities,
        };
        Estimate {
            answer,
            n_rows,
            n_in_total: self.n_rows,
            contexts: contexts.iter().enumerate().map(of_context).collect(),
            rows: rows.into_iter().map(of_row).collect(),
        }
    }
}

/// Probabilities after each row.
fn follow(
    args: &Args,
    model: &RobotModel,
    samples: &Samples,
    prior: &ContextPrior,
    interval: Option<f64>,
) -> Result<Vec<Vec<f64>>, TorqueError> {
    let m = model.contexts().len();
    let chain = match (args.switching, interval) {
        (Some(rate), Some(interval)) => ContextTransition::switching(m, rate, interval)?,
        _ => ContextTransition::none(m),
    };
    let model = model.for_tracking()?;
    let posteriors = model.tasks().map(|(_, process)| &process.posterior);
    let tracker = ContextTracker::new(posteriors, args.window, prior, chain)?;
    let noise = vec![args.noise; model.learned().len()];
    let correlation = samples.rows_per_independent(LEAST_SECONDS)?;
    let tracker = tracker.with_torque_noise(&noise)?;
    let mut tracker = tracker.of_correlated(correlation);
    let mut rows = Vec::with_capacity(samples.n_rows());
    for row in 0..samples.n_rows() {
        let x: Vec<f64> = samples.x.row(row).iter().copied().collect();
        let joints = samples.torques.iter();
        let torques: Vec<Option<f64>> = joints.map(|joint| Some(joint.values[row])).collect();
        let log_probabilities = tracker.step(&x, &torques)?;
        rows.push(log_probabilities.iter().map(|log| log.exp()).collect());
    }
    Ok(rows)
}

fn most_probable(probabilities: &[f64]) -> usize {
    let mut best = 0;
    for (idx, probability) in probabilities.iter().enumerate() {
        if *probability > probabilities[best] {
            best = idx;
        }
    }
    best
}

fn write_rows(path: &Path, contexts: &[String], rows: &[Vec<f64>]) -> Result<(), CliError> {
    let known = contexts.iter().map(|context| format!("p_{context}"));
    let header = std::iter::once("most_probable".to_owned()).chain(known);
    let records = rows.iter().map(|row| {
        let numbers = row.iter().map(|probability| format!("{probability:?}"));
        let most = contexts[most_probable(row)].clone();
        std::iter::once(most).chain(numbers).collect()
    });
    write_records(path, header.collect(), records)
}

/// A table of texts.
fn write_records(
    path: &Path,
    header: Vec<String>,
    records: impl Iterator<Item = Vec<String>>,
) -> Result<(), CliError> {
    let mut output = Output::create(path)?;
    let name = output.name().to_owned();
    let (mut text, mut n_rows) = (Vec::new(), 0);
    {
        let mut writer = csv::Writer::from_writer(&mut text);
        let written = std::iter::once(header)
            .chain(records)
            .try_for_each(|record| {
                n_rows += 1;
                writer.write_record(&record)
            });
        let flushed = written.map_err(std::io::Error::other);
        flushed
            .and_then(|()| writer.flush())
            .map_err(CliError::io("write", name.clone()))?;
    }
    output
        .write_all(&text)
        .map_err(CliError::io("write", name.clone()))?;
    output.commit()?;
    messages::note(format!("{} rows written to {name}", n_rows - 1));
    Ok(())
}

impl Estimate {
    fn table(&self) -> String {
        let header = ["context", "log density", "probability", "p-value"];
        let rows: Vec<Vec<String>> = (self.contexts.iter())
            .map(|context| {
                vec![
                    context.context.clone(),
                    format!("{:.2}", context.log_density),
                    format!("{:.6}", context.probability),
                    format!("{:.4}", context.p_value),
                ]
            })
            .collect();
        let mut text = text_table::render(&header, &rows);
        let answer = self.answer.as_deref().unwrap_or("none of these");
        let rows = match (self.n_in_total, self.n_rows) {
            (some, all) if some < all => format!("{some} of {all} rows"),
            (_, all) => format!("{all} rows"),
        };
        text = format!("{text}\nin total ({rows}): {answer}\n");
        if let Some(last) = self.rows.last() {
            let context = &last.context;
            text = format!("{text}after the last row: {context}\n");
        }
        text
    }
}

fn not_negative(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number >= 0.0 && number.is_finite() => Ok(number),
        _ => Err("not a number from 0".to_owned()),
    }
}

fn probability(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if (0.0..=1.0).contains(&number) => Ok(number),
        _ => Err("not a number from 0 to 1".to_owned()),
    }
}
