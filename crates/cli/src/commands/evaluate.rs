//! `torque-gp evaluate`: how well a learned model predicts measured torques.

use std::io::Write;
use std::path::{Path, PathBuf};

use gp_core::TorqueModel;
use serde::Serialize;

use crate::commands::predict::{BLOCK, predict};
use crate::error::CliError;
use crate::messages;
use crate::model_file;
use crate::output::Output;
use crate::range_watch::RangeWatch;
use crate::samples::{DataColumns, Samples};
use crate::score::Score;
use crate::table::Table;
use crate::text_table;

/// Compare a learned model's torques with measured ones
///
/// DATA has the columns of `torque-gp fit`, with a torque for every joint of the model; other columns are ignored.
/// Per joint, on standard output:
///   nMSE      mean squared error / variance of the measured torques: 0 perfect, 1 as good as their mean
///   RMSE      root mean squared error, N·m
///   log density   mean log predictive density in nats, of a density per N·m, with the noise of a measurement
///   coverage  part of the measured torques inside the model's 95 % interval: 0.95 if the model knows its errors
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES, verbatim_doc_comment)]
pub struct Args {
    /// Model file of `torque-gp fit`
    #[arg(long, value_name = "FILE.tgp")]
    model: PathBuf,

    /// Measured states and torques; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    data: PathBuf,

    /// Rows to compare with, by their entry in the column `context`
    #[arg(long, value_name = "NAME")]
    context: Option<String>,

    /// Start of the torque columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    tau_prefix: String,

    /// Write JSON, with numbers in full
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp evaluate --model model.tgp --data test.csv
  torque-gp evaluate --model model.tgp --data log.csv --context c3 --json

JSON: {\"n_samples\": …, \"joints\": [{\"joint\": \"joint1\", \"nmse\": …, \"rmse\": …,
\"mean_log_predictive_density\": …, \"coverage_95\": …}, …]}; nmse is null where the measured torques are all equal.

Exit status: 0, or 2 for bad input or usage; then there is one message.";

/// What is written as JSON.
#[derive(Serialize)]
struct Evaluation {
    n_samples: usize,
    joints: Vec<JointScore>,
}

#[derive(Serialize)]
struct JointScore {
    joint: String,
    #[serde(flatten)]
    score: Score,
}

/// Reads the data, prints the measures.
///
/// # Errors
/// Anything wrong with the options or a file.
pub fn run(args: &Args) -> Result<(), CliError> {
    let model = model_file::load(&args.model)?;
    let table = Table::open(&args.data)?;
    let file = table.file().to_owned();
    let learned: Vec<usize> = model
        .learned()
        .iter()
        .map(|(joint_idx, _)| *joint_idx)
        .collect();
    let joints = model_file::joints(&model);
    let columns = DataColumns::of_joints(&table, joints, &args.tau_prefix, &learned)?;
    model_file::note_order(&file, &columns.states, &model);
    let samples = columns.read(table, args.context.as_deref())?;
    warn(&file, &samples, &columns, &model);

    let evaluation = evaluate(&model, &samples, &file)?;
    let mut output = Output::create(Path::new("-"))?;
    let text = if args.json {
        json(&evaluation)?
    } else {
        evaluation.table()
    };
    output
        .write_all(text.as_bytes())
        .map_err(CliError::io("write", "standard output"))?;
    output.commit()
}

fn warn(file: &str, samples: &Samples, columns: &DataColumns, model: &TorqueModel) {
    let context = &model.provenance().context;
    if !context.is_empty() && !samples.context.is_empty() && *context != samples.context {
        messages::warning(format!(
            "{file}: measured with `{}`, but the model was learned with `{context}`",
            samples.context
        ));
    }
    for doubt in &samples.doubts {
        messages::warning(format!("{file}: {doubt}"));
    }
    let mut ranges = RangeWatch::new(model.ranges());
    let mut state = vec![0.0; samples.x.ncols()];
    for row in 0..samples.x.nrows() {
        for (value, entry) in state.iter_mut().zip(samples.x.row(row).iter()) {
            *value = *entry;
        }
        ranges.see(&state);
    }
    ranges
        .doubt(file, &columns.states.states)
        .into_iter()
        .for_each(messages::warning);
}

fn evaluate(model: &TorqueModel, samples: &Samples, file: &str) -> Result<Evaluation, CliError> {
    let n_samples = samples.x.nrows();
    let mut moments = vec![(Vec::new(), Vec::new(), 0.0); samples.torques.len()];
    for first in (0..n_samples).step_by(BLOCK) {
        let block = samples.x.subrows(first, BLOCK.min(n_samples - first));
        for (joint, prediction) in moments.iter_mut().zip(predict(model, block, file, first)?) {
            joint.0.extend(prediction.mean);
            joint.1.extend(prediction.var);
            joint.2 = prediction.noise_var;
        }
    }
    let joints = samples.torques.iter().zip(&moments);
    let joints = joints.map(|(torques, (mean, var, noise_var))| JointScore {
        joint: model.joint_names()[torques.joint_idx].clone(),
        score: Score::of(&torques.values, mean, var, *noise_var),
    });
    Ok(Evaluation {
        n_samples,
        joints: joints.collect(),
    })
}

impl Evaluation {
    fn table(&self) -> String {
        let header = [
            "joint",
            "samples",
            "nMSE",
            "RMSE (N·m)",
            "log density",
            "coverage of 95 %",
        ];
        let row = |JointScore { joint, score }: &JointScore| {
            vec![
                joint.clone(),
                self.n_samples.to_string(),
                score
                    .nmse
                    .map_or("undefined".to_owned(), |nmse| format!("{nmse:.3e}")),
                format!("{:.4e}", score.rmse),
                format!("{:.4}", score.mean_log_predictive_density),
                format!("{:.1} %", 100.0 * score.coverage_95),
            ]
        };
        text_table::render(&header, &self.joints.iter().map(row).collect::<Vec<_>>())
    }
}

/// A value as indented JSON with a line end; floats have the fewest digits that read back exactly.
///
/// # Errors
/// None for values without maps.
pub fn json(value: &impl Serialize) -> Result<String, CliError> {
    let text = serde_json::to_string_pretty(value)
        .map_err(std::io::Error::other)
        .map_err(CliError::io("write", "JSON"))?;
    Ok(text + "\n")
}
