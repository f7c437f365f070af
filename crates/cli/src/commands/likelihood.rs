//! `torque-gp likelihood`: the log marginal likelihood of given hyperparameters, and its gradient.

use std::io::Write;
use std::path::{Path, PathBuf};

use gp_core::{GpError, LikelihoodOptions, evidence};
use serde::Serialize;

use crate::commands::evaluate::json;
use crate::error::CliError;
use crate::hyperparameter_file::Hyperparameters;
use crate::messages;
use crate::method::{self, MethodArg};
use crate::output::Output;
use crate::samples::{DataColumns, Samples};
use crate::table::Table;
use crate::text_table;

/// Log marginal likelihood of one joint's torques under given hyperparameters, with its gradient
///
/// DATA has the columns of `torque-gp fit`; the likelihood is of all its rows, natural log, summed over them.
/// The gradient is with respect to the numbers of the hyperparameter file, which are standard deviations and
/// length scales, not their squares or logarithms.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Measured states and torques; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    data: PathBuf,

    /// Joint whose torques are taken, by number or name
    #[arg(long, value_name = "JOINT")]
    joint: String,

    /// Hyperparameters (see below)
    #[arg(long, value_name = "FILE.toml")]
    hyperparameters: PathBuf,

    /// How the covariance matrix is factorised
    #[arg(long, value_enum, default_value_t = MethodArg::Automatic)]
    method: MethodArg,

    /// Rows to take, by their entry in the column `context`
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
  torque-gp likelihood --data train.csv --joint 3 --hyperparameters h.toml
  torque-gp likelihood --data train.csv --joint elbow --hyperparameters h.toml --method dense --json

Hyperparameter file, for N joints:
  bias_std = 3.0                # N·m
  linear_std = [1.0, 0.2, …]    # 3N: q1..qN, qd1..qdN, qdd1..qddN; N·m per unit of each
  signal_std = 5.0              # N·m
  length_scales = [0.5, 0.7, …] # 3N, in the unit of each
  coulomb_std = [1.0, 0.1, …]   # N, N·m; leave it out for no Coulomb friction
  noise_std = 0.01              # N·m
  Zeros in bias_std, linear_std, signal_std and coulomb_std switch a term off.

JSON: log_marginal_likelihood; gradient (an object with the names of the file); error_bound, in nats: what the
certified method leaves out and what rounding the covariances leaves in either; method; rank.

Exit status: 0, or 2 for bad input or usage; then there is one message.";

/// What is written as JSON.
#[derive(Serialize)]
struct Outcome {
    log_marginal_likelihood: f64,
    gradient: Hyperparameters,
    /// Nats.
    error_bound: f64,
    method: &'static str,
    rank: usize,
}

/// Reads data and hyperparameters, prints the likelihood.
///
/// # Errors
/// Anything wrong with the options or a file, and a covariance matrix that is not positive definite.
pub fn run(args: &Args) -> Result<(), CliError> {
    let table = Table::open(&args.data)?;
    let file = table.file().to_owned();
    let asked = std::slice::from_ref(&args.joint);
    let columns = DataColumns::of_header(&table, &args.tau_prefix, "--joint", asked)?;
    let n_joints = columns.joints.names.len();
    let hyperparameters = Hyperparameters::load(&args.hyperparameters, n_joints)?;
    let samples = columns.read(table, args.context.as_deref())?;
    for doubt in &samples.doubts {
        messages::warning(format!("{file}: {doubt}"));
    }
    let outcome =
        likelihood(&samples, &hyperparameters, n_joints, args.method).map_err(|cause| {
            CliError::Joint {
                file,
                joint: columns.joints.names[samples.torques[0].joint_idx].clone(),
                cause: Box::new(cause),
            }
        })?;

    let text = if args.json {
        json(&outcome)?
    } else {
        outcome.table(&hyperparameters)
    };
    let mut output = Output::create(Path::new("-"))?;
    output
        .write_all(text.as_bytes())
        .map_err(CliError::io("write", "standard output"))?;
    output.commit()
}

fn likelihood(
    samples: &Samples,
    hyperparameters: &Hyperparameters,
    n_joints: usize,
    method: MethodArg,
) -> Result<Outcome, GpError> {
    let covariance = hyperparameters.covariance(n_joints);
    let options = LikelihoodOptions {
        method: method.method(),
        ..LikelihoodOptions::automatic()
    };
    let evidence = evidence(
        &covariance,
        hyperparameters.noise_std,
        samples.x.as_ref(),
        &samples.torques[0].values,
        options,
    )?;
    Ok(Outcome {
        log_marginal_likelihood: evidence.evaluation.log_marginal_likelihood,
        gradient: Hyperparameters::named(&covariance, &evidence.gradient),
        error_bound: evidence.evaluation.error_bound,
        method: method::name(evidence.evaluation.method),
        rank: evidence.evaluation.rank,
    })
}

impl Outcome {
    fn table(&self, hyperparameters: &Hyperparameters) -> String {
        let rows: Vec<Vec<String>> = hyperparameters
            .entries()
            .into_iter()
            .zip(self.gradient.entries())
            .map(|((name, value), (_, derivative))| {
                vec![name, format!("{value:?}"), format!("{derivative:.9e}")]
            })
            .collect();
        format!(
            "log marginal likelihood {:?} ± {:.1e} nats ({}, rank {})\n\n{}",
            self.log_marginal_likelihood,
            self.error_bound,
            self.method,
            self.rank,
            text_table::render(&["hyperparameter", "value", "derivative"], &rows)
        )
    }
}
