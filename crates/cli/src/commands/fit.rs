//! `torque-gp fit`: learns joint torques from a CSV of measured states and torques.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use clap::ValueEnum;
use gp_core::{
    BayesLinear, FitOptions, GpError, JointModel, LinearForm, Provenance, TorqueModel,
    TrainingRanges,
};
use kernels::TorqueForm;
use rayon::prelude::*;
use sha2::{Digest, Sha256};

use crate::error::CliError;
use crate::messages;
use crate::method::MethodArg;
use crate::output::{self, Output};
use crate::samples::{DataColumns, JointTorques, Samples};
use crate::score::is_constant;
use crate::table::{self, Table};
use crate::text_table;

/// Rows of data above which the memory of a fit is worth a word: two matrices of 1 GB.
const MANY_ROWS: usize = 11_000;

/// Learn joint torques from measured states and torques, for one load
///
/// DATA has a header with q1..qN, qd1..qdN, qdd1..qddN and tau1..tauN (or q_<joint>, …, tau_<joint>), in any column
/// order, and one row per sample; other columns are ignored.
/// Joints are those of the state columns, in file order; torques may be there for some of them only.
/// Numbers are rad, rad/s, rad/s² and N·m; m, m/s, m/s² and N for sliding joints.
///
/// A model is for one load: a column `context` with several needs --context.
/// Every joint is learned by itself, several at a time; the result is the same, bit by bit, for any --threads.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Measured states and torques; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    data: PathBuf,

    /// What is learned
    #[arg(long, value_enum, default_value_t = ModelArg::Gpc)]
    model: ModelArg,

    /// Joints to learn, by number or name [default: all with a torque column]
    #[arg(long, value_name = "JOINT,…", value_delimiter = ',')]
    joints: Vec<String>,

    /// From where the search for hyperparameters sets out (gp and gpc)
    #[arg(long, value_enum, default_value_t = StartsArg::Several)]
    starts: StartsArg,

    /// How likelihoods are computed (gp and gpc)
    #[arg(long, value_enum, default_value_t = MethodArg::Automatic)]
    method: MethodArg,

    /// Rows to learn from, by their entry in the column `context`
    #[arg(long, value_name = "NAME")]
    context: Option<String>,

    /// Start of the torque columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    tau_prefix: String,

    /// Joints learned at a time [default: one per processor]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,

    /// Model file
    #[arg(long, value_name = "FILE.tgp")]
    output: PathBuf,
}

/// The four models of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ModelArg {
    /// Gaussian process with Coulomb friction: the most accurate
    Gpc,
    /// Gaussian process without Coulomb friction
    Gp,
    /// Linear regression with the signs of the speeds (Coulomb friction)
    Lrc,
    /// Linear regression
    Lr,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum StartsArg {
    /// The one of the data's moments (eq. 22 of the chapter)
    Chapter,
    /// That one and three variations of it, beyond 512 rows on more and more of them; the highest likelihood is kept
    Several,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp fit --data train.csv --output model.tgp
  torque-gp fit --data log.csv --context c3 --joints 1,3 --model lrc --output model.tgp
  torque-gp fit --data log.csv --joints shoulder,elbow --starts chapter --threads 1 --output model.tgp

Then:
  torque-gp predict --model model.tgp --input states.csv --output torques.csv
  torque-gp evaluate --model model.tgp --data test.csv

Standard error has a line per finished joint and a table of the fits at the end: log marginal likelihood in nats
(natural log, summed over the samples), the start that won, likelihoods computed, the noise found, bounds hit.

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads the data, learns every joint, writes the model.
///
/// # Errors
/// Anything wrong with the options or the data, or a joint that cannot be learned; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    output::check_not_an_input(&args.output, &[&args.data])?;
    let (file, bytes) = table::read_bytes(&args.data)?;
    let data_sha256 = Sha256::digest(&bytes).into();
    let table = Table::from_bytes(file.clone(), bytes)?;
    let columns = DataColumns::of_header(&table, &args.tau_prefix, "--joints", &args.joints)?;
    let samples = columns.read(table, args.context.as_deref())?;
    check(&file, &samples, &columns)?;
    let mut output = Output::create(&args.output)?;

    let learner = Learner {
        args,
        file: &file,
        samples: &samples,
        joint_names: &columns.joints.names,
    };
    let fits = learner.learn_all()?;
    messages::report(report(&fits, &columns.joints.names));

    let provenance = Provenance {
        data_sha256,
        robot_sha256: None,
        program: concat!("torque-gp ", env!("CARGO_PKG_VERSION")).to_owned(),
        context: samples.context.clone(),
    };
    let learned = fits.into_iter().map(|fit| (fit.joint_idx, fit.model));
    let unusable = |cause: GpError| CliError::Usage(format!("{file}: {cause}"));
    let model = TorqueModel::new(
        columns.joints.names.clone(),
        learned.collect(),
        TrainingRanges::of(samples.x.as_ref()).map_err(unusable)?,
        provenance,
    )
    .map_err(unusable)?;
    let name = output.name().to_owned();
    output
        .write_all(&model.to_bytes())
        .map_err(CliError::io("write", name.clone()))?;
    output.commit()?;
    messages::note(format!("{name} written"));
    Ok(())
}

/// Refuses data that says nothing, warns of data that is probably not what it seems.
fn check(file: &str, samples: &Samples, columns: &DataColumns) -> Result<(), CliError> {
    let n_rows = samples.x.nrows();
    if n_rows < 2 {
        return Err(CliError::Columns {
            file: file.to_owned(),
            reason: format!("{n_rows} row of data; at least 2 are needed to learn from"),
        });
    }
    for doubt in &samples.doubts {
        messages::warning(format!("{file}: {doubt}"));
    }
    for JointTorques { joint_idx, values } in &samples.torques {
        if is_constant(values) {
            let (joint, value) = (&columns.joints.names[*joint_idx], values[0]);
            messages::warning(format!(
                "{file}: the torque of `{joint}` is {value} N·m in every row: there is nothing to learn but that"
            ));
        }
    }
    if n_rows > MANY_ROWS {
        let gigabytes = 16.0 * (n_rows as f64).powi(2) / 1e9;
        messages::warning(format!(
            "{file}: {n_rows} rows: a Gaussian process may take {gigabytes:.0} GB for each joint learned at a time"
        ));
    }
    Ok(())
}

/// A learned joint.
struct JointFit {
    joint_idx: usize,
    model: JointModel,
    n_samples: usize,
    seconds: f64,
}

/// What every joint is learned from.
struct Learner<'a> {
    args: &'a Args,
    file: &'a str,
    samples: &'a Samples,
    joint_names: &'a [String],
}

impl Learner<'_> {
    /// Learns the joints side by side, each sequentially; of several failures the first joint's counts.
    fn learn_all(&self) -> Result<Vec<JointFit>, CliError> {
        let jobs = &self.samples.torques;
        let asked = self
            .args
            .threads
            .or(std::thread::available_parallelism().ok());
        let n_threads = asked.map_or(1, NonZeroUsize::get).min(jobs.len());
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(n_threads)
            .build()
            .map_err(|error| {
                CliError::Usage(format!("cannot start {n_threads} threads: {error}"))
            })?;
        let n_finished = AtomicUsize::new(0);
        let fits: Vec<_> = pool.install(|| {
            jobs.par_iter()
                .map(|job| self.learn(job, &n_finished))
                .collect()
        });
        fits.into_iter().collect()
    }

    fn learn(&self, job: &JointTorques, n_finished: &AtomicUsize) -> Result<JointFit, CliError> {
        let started = Instant::now();
        let joint = &self.joint_names[job.joint_idx];
        let model = self.model(&job.values).map_err(|cause| CliError::Joint {
            file: self.file.to_owned(),
            joint: joint.clone(),
            cause: Box::new(cause),
        })?;
        let n_finished = n_finished.fetch_add(1, Ordering::Relaxed) + 1;
        let n_joints = self.samples.torques.len();
        messages::note(format!("{joint} learned ({n_finished} of {n_joints})"));
        Ok(JointFit {
            joint_idx: job.joint_idx,
            model,
            n_samples: job.values.len(),
            seconds: started.elapsed().as_secs_f64(),
        })
    }

    fn model(&self, torques: &[f64]) -> Result<JointModel, GpError> {
        let x = self.samples.x.as_ref();
        let mut options = match self.args.starts {
            StartsArg::Chapter => FitOptions::chapter(),
            StartsArg::Several => FitOptions::several(),
        };
        options.likelihood.method = self.args.method.method();
        Ok(match self.args.model {
            ModelArg::Gpc => gp_core::fit(x, torques, TorqueForm::Coulomb, &options)?.into(),
            ModelArg::Gp => gp_core::fit(x, torques, TorqueForm::Smooth, &options)?.into(),
            ModelArg::Lrc => BayesLinear::fit(x, torques, LinearForm::Coulomb)?.into(),
            ModelArg::Lr => BayesLinear::fit(x, torques, LinearForm::Smooth)?.into(),
        })
    }
}

/// The table of the fits.
fn report(fits: &[JointFit], joint_names: &[String]) -> String {
    let header = [
        "joint",
        "model",
        "samples",
        "log likelihood",
        "error bound",
        "start",
        "evaluations",
        "noise std (N·m)",
        "factor",
        "seconds",
        "bounds hit",
    ];
    let rows: Vec<Vec<String>> = fits
        .iter()
        .map(|fit| report_row(fit, &joint_names[fit.joint_idx]))
        .collect();
    text_table::render(&header, &rows)
}

fn report_row(fit: &JointFit, joint: &str) -> Vec<String> {
    let summary = fit.model.summary();
    let entry = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    let bounds = summary
        .map(|s| s.bounds_hit.join(" "))
        .filter(|names| !names.is_empty());
    vec![
        joint.to_owned(),
        fit.model.kind().to_string(),
        fit.n_samples.to_string(),
        entry(summary.map(|s| format!("{:.3}", s.log_marginal))),
        entry(
            summary
                .and_then(|s| s.error_bound)
                .map(|bound| format!("{bound:.1e}")),
        ),
        entry(summary.map(|s| s.start.clone())),
        entry(summary.map(|s| s.evaluations.to_string())),
        format!("{:.4}", fit.model.noise_var().sqrt()),
        entry(summary.map(|s| format!("{}, rank {}", s.method, s.rank))),
        format!("{:.1}", fit.seconds),
        entry(bounds),
    ]
}
