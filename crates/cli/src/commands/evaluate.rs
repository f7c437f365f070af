//! `torque-gp evaluate`: how well a learned model predicts measured torques.

use std::path::PathBuf;

use serde::Serialize;
use torque_model::{JointPrediction, JointTorques};

use crate::context::{COLUMN, columns_error, listed};
use crate::context_column::ContextColumn;
use crate::data_args::DataArgs;
use crate::error::CliError;
use crate::messages;
use crate::model_file::ModelFile;
use crate::printed::PrintArgs;
use crate::range_watch::warn_outside;
use crate::row_contexts::RowContexts;
use crate::samples::{Data, DataColumns};
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
/// Of a model of several contexts, each row is judged in the one of its column `context`; with --context those of that
/// one alone, which in a file without the column are all rows.
/// With --payload, all rows are judged for one load that need not have been carried before, by its data sheet.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES, verbatim_doc_comment)]
pub struct Args {
    /// Model file of `torque-gp fit`
    #[arg(long, value_name = "FILE.tgp")]
    model: PathBuf,

    #[command(flatten)]
    data: DataArgs,

    /// Load that is carried in all rows, by its data sheet: see `predict --help`
    #[arg(long, value_name = "FILE.toml", conflicts_with = "context")]
    payload: Option<PathBuf>,

    #[command(flatten)]
    print: PrintArgs,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp evaluate --model model.tgp --data test.csv
  torque-gp evaluate --model model.tgp --data log.csv --context c3 --json
  torque-gp evaluate --model mgp.tgp --data new.csv --payload new.toml

JSON: {\"n_samples\": …, \"rows\": …, \"joints\": [{\"joint\": \"joint1\", \"nmse\": …, \"rmse\": …,
\"mean_log_predictive_density\": …, \"coverage_95\": …}, …]}; nmse is null where the measured torques are all equal.
Of a model of several contexts, every context's rows are judged by themselves, with their mean over the contexts:
{\"n_samples\": …, \"rows\": …, \"contexts\": [{\"context\": \"c1\", \"n_samples\": …, \"joints\": […]}, …], \"average\": […]};
where only one of them has rows, \"joints\" stands at the top, too.

Exit status: 0, or 2 for bad input or usage; then there is one message.";

/// What is written as JSON for a model of one context.
#[derive(Serialize)]
struct Evaluation {
    n_samples: usize,
    /// The same number.
    rows: usize,
    joints: Vec<JointScore>,
}

#[derive(Serialize, Clone)]
struct JointScore {
    joint: String,
    #[serde(flatten)]
    score: Score,
}

/// What is written as JSON for a model of several contexts.
#[derive(Serialize)]
struct ContextEvaluation {
    n_samples: usize,
    /// The same number.
    rows: usize,
    contexts: Vec<ContextScores>,
    /// The scores of the only context that has rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    joints: Option<Vec<JointScore>>,
    /// Means over the contexts, of nMSE over those that have one.
    average: Vec<JointScore>,
}

#[derive(Serialize)]
struct ContextScores {
    context: String,
    n_samples: usize,
    joints: Vec<JointScore>,
}

/// Reads the data, prints the measures.
///
/// # Errors
/// Anything wrong with the options or a file.
pub fn run(args: &Args) -> Result<(), CliError> {
    let (model, loaded) = ModelFile::load(&args.model)?.with_payload(args.payload.as_deref())?;
    let table = Table::open(&args.data.path)?;
    let file = table.file().to_owned();
    let tau_prefix = &args.data.tau_prefix;
    let learned = model.learned_joints();
    let columns = DataColumns::of_joints(&table, model.joints(), tau_prefix, &learned)?;
    model.note_order(&file, &columns.states);
    let (data, numbers) = match loaded {
        Some(number) => read_of_one_load(&columns, table, number)?,
        None => read(args, &model, &columns, table)?,
    };
    warn(&file, &data, &columns, &model);

    let x = model
        .states_of(&data.samples)
        .map_err(CliError::of_data(&file))?;
    let scores = Scores {
        torques: &data.samples.torques,
        joint_names: model.joint_names(),
        predictions: model.predict_rows(&numbers, (*x).as_ref(), &file, 0)?,
    };
    match model.contexts() {
        [] => {
            let rows: Vec<usize> = (0..numbers.len()).collect();
            let evaluation = Evaluation {
                n_samples: rows.len(),
                rows: rows.len(),
                joints: scores.of_rows(&rows),
            };
            args.print.print(&evaluation, Evaluation::table)
        }
        contexts => {
            let evaluation = ContextEvaluation::new(&scores, contexts, &numbers);
            args.print.print(&evaluation, ContextEvaluation::table)
        }
    }
}

/// The rows and the numbers of their contexts.
fn read(
    args: &Args,
    model: &ModelFile,
    columns: &DataColumns,
    mut table: Table,
) -> Result<(Data, Vec<usize>), CliError> {
    let asked = args.data.context.as_deref();
    let has_column = table.column_names().iter().any(|name| name == COLUMN);
    let of_one = |table: &mut Table, asked: Option<&str>, number: usize| {
        let data = columns.read(table, asked)?;
        let numbers = vec![number; data.samples.n_rows()];
        Ok((data, numbers))
    };
    if model.contexts().is_empty() {
        // Rows of a file that does not say are those of the one context that the model is for.
        let is_own = asked.is_some_and(|asked| asked == model.provenance().context);
        let chosen = asked.filter(|_| has_column || !is_own);
        return of_one(&mut table, chosen, 0);
    }
    match RowContexts::new(model, &table, asked)? {
        RowContexts::Same(number) => of_one(&mut table, asked.filter(|_| has_column), number),
        RowContexts::Column(column) => {
            let data = columns.read_all(&mut table, column)?;
            let numbers = data.samples.context_of.clone();
            Ok((data, numbers))
        }
    }
}

/// All rows, which must be of one load, whatever its name.
fn read_of_one_load(
    columns: &DataColumns,
    mut table: Table,
    number: usize,
) -> Result<(Data, Vec<usize>), CliError> {
    let (file, header) = (table.file().to_owned(), table.column_names());
    let data = if header.iter().any(|name| name == COLUMN) {
        let contexts = ContextColumn::of_any(&file, &header)?;
        columns
            .read_all(&mut table, contexts)?
            .without_only_context()
    } else {
        columns.read(&mut table, None)?
    };
    if data.samples.contexts.len() > 1 {
        let several = listed(&data.samples.contexts);
        let reason =
            format!("rows of several contexts ({several}); --payload is the load of all rows");
        return Err(columns_error(&file, reason));
    }
    let numbers = vec![number; data.samples.n_rows()];
    Ok((data, numbers))
}

fn warn(file: &str, data: &Data, columns: &DataColumns, model: &ModelFile) {
    let context = &model.provenance().context;
    if !context.is_empty() && !data.context.is_empty() && *context != data.context {
        messages::warning(format!(
            "{file}: measured with `{}`, but the model was learned with `{context}`",
            data.context
        ));
    }
    data.warn(file);
    let x = data.samples.x.as_ref();
    warn_outside(model.ranges(), x, file, &columns.states.states);
}

/// Predictions at all samples, to be compared with the torques of some of them.
struct Scores<'a> {
    torques: &'a [JointTorques],
    joint_names: &'a [String],
    predictions: Vec<JointPrediction>,
}

impl Scores<'_> {
    fn of_rows(&self, rows: &[usize]) -> Vec<JointScore> {
        let of = |values: &[f64]| rows.iter().map(|row| values[*row]).collect::<Vec<f64>>();
        let joints = self.torques.iter().zip(&self.predictions);
        let score = |(torques, joint): (&JointTorques, &JointPrediction)| JointScore {
            joint: self.joint_names[torques.joint_idx].clone(),
            score: Score::of(
                &of(&torques.values),
                &of(&joint.mean),
                &of(&joint.var),
                &of(&joint.noise_var),
            ),
        };
        joints.map(score).collect()
    }
}

impl ContextEvaluation {
    fn new(scores: &Scores<'_>, contexts: &[String], numbers: &[usize]) -> Self {
        let of_context = |(number, context): (usize, &String)| {
            let rows: Vec<usize> = (0..numbers.len())
                .filter(|row| numbers[*row] == number)
                .collect();
            (!rows.is_empty()).then(|| ContextScores {
                context: context.clone(),
                n_samples: rows.len(),
                joints: scores.of_rows(&rows),
            })
        };
        let contexts: Vec<ContextScores> =
            contexts.iter().enumerate().filter_map(of_context).collect();
        let average = |joint: usize| {
            let scores: Vec<Score> = contexts.iter().map(|c| c.joints[joint].score).collect();
            JointScore {
                joint: contexts[0].joints[joint].joint.clone(),
                score: Score::average(&scores),
            }
        };
        let n_joints = contexts.first().map_or(0, |context| context.joints.len());
        Self {
            n_samples: numbers.len(),
            rows: numbers.len(),
            average: (0..n_joints).map(average).collect(),
            joints: match contexts.as_slice() {
                [only] => Some(only.joints.clone()),
                _ => None,
            },
            contexts,
        }
    }

    fn table(&self) -> String {
        let mut header = vec!["context"];
        header.extend(HEADER);
        let rows_of = |name: &str, n_samples: usize, joints: &[JointScore]| -> Vec<Vec<String>> {
            let row = |score: &JointScore| [vec![name.to_owned()], score.row(n_samples)].concat();
            joints.iter().map(row).collect()
        };
        let of_contexts = self.contexts.iter();
        let rows: Vec<Vec<String>> = of_contexts
            .flat_map(|context| rows_of(&context.context, context.n_samples, &context.joints))
            .chain(rows_of("average", self.n_samples, &self.average))
            .collect();
        text_table::render(&header, &rows)
    }
}

const HEADER: [&str; 6] = [
    "joint",
    "samples",
    "nMSE",
    "RMSE (N·m)",
    "log density",
    "coverage of 95 %",
];

impl JointScore {
    fn row(&self, n_samples: usize) -> Vec<String> {
        let Self { joint, score } = self;
        vec![
            joint.clone(),
            n_samples.to_string(),
            score
                .nmse
                .map_or("undefined".to_owned(), |nmse| format!("{nmse:.3e}")),
            format!("{:.4e}", score.rmse),
            format!("{:.4}", score.mean_log_predictive_density),
            format!("{:.1} %", 100.0 * score.coverage_95),
        ]
    }
}

impl Evaluation {
    fn table(&self) -> String {
        let rows: Vec<Vec<String>> = self.joints.iter().map(|j| j.row(self.n_samples)).collect();
        text_table::render(&HEADER, &rows)
    }
}
