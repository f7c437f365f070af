//! `torque-gp likelihood`: the log marginal likelihood of given hyperparameters, and its gradient.

use std::path::PathBuf;

use gp_core::LikelihoodOptions;
use gp_core::evidence::{Evidence, evidence};
use kernels::TorqueCovariance;
use mtgp::Stacked;
use mtgp::prior::TaskNoise;
use serde::Serialize;
use torque_model::{Samples, TorqueError};

use crate::context_column::ContextColumn;
use crate::data_args::DataArgs;
use crate::error::CliError;
use crate::hyperparameter_file::Hyperparameters;
use crate::method::MethodArg;
use crate::noise_std::NoiseStd;
use crate::printed::PrintArgs;
use crate::samples::{Data, DataColumns};
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
    #[command(flatten)]
    data: DataArgs,

    /// Joint whose torques are taken, by number or name
    #[arg(long, value_name = "JOINT")]
    joint: String,

    /// Hyperparameters (see below)
    #[arg(long, value_name = "FILE.toml")]
    hyperparameters: PathBuf,

    /// How the covariance matrix is factorised
    #[arg(long, value_enum, default_value_t = MethodArg::Automatic)]
    method: MethodArg,

    #[command(flatten)]
    print: PrintArgs,
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
  continuous = [\"wrist\"]        # joints that turn without end, if any: of their q, u is in N·m, and l is of the
                                # chord 2 sin(½ difference), without unit
  Zeros in bias_std, linear_std, signal_std and coulomb_std switch a term off.
For data of several contexts, which then needs the column `context`, also:
  contexts = [\"c1\", \"c2\", \"c3\"]        # all that the data has, and no others
  task_factor = [[1.1], [0.5, 0.8], [0.9, -0.3]]   # Λ, where ΛΛᵀ relates the contexts: a row for each
  noise_std = [0.01, 0.02, 0.01]      # one for each context, or a number for all

JSON: log_marginal_likelihood; gradient (an object with the names of the file; task_factor as a row for each
context, with zeros above the diagonal); error_bound, in nats: what the
certified method leaves out and what rounding the covariances leaves in either; method; rank.

Exit status: 0, or 2 for bad input or usage; then there is one message.";

/// What is written as JSON.
#[derive(Serialize)]
struct Outcome {
    log_marginal_likelihood: f64,
    gradient: Hyperparameters,
    /// Nats.
    error_bound: f64,
    method: String,
    rank: usize,
}

/// Reads data and hyperparameters, prints the likelihood.
///
/// # Errors
/// Anything wrong with the options or a file, and a covariance matrix that is not positive definite.
pub fn run(args: &Args) -> Result<(), CliError> {
    let table = Table::open(&args.data.path)?;
    let file = table.file().to_owned();
    let asked = std::slice::from_ref(&args.joint);
    let columns = DataColumns::of_header(&table, &args.data.tau_prefix, "--joint", asked)?;
    let hyperparameters = Hyperparameters::load(&args.hyperparameters, &columns.joints)?;
    let covariance = hyperparameters.covariance(&columns.joints)?;
    let job = Job {
        args,
        hyperparameters: &hyperparameters,
        covariance: &covariance,
    };
    let data = job.read(table, &columns)?;
    data.warn(&file);
    let samples = &data.samples;
    let outcome = job.outcome(samples).map_err(|cause| CliError::Joint {
        file,
        joint: samples.name_of(&samples.torques[0]).to_owned(),
        cause: Box::new(cause),
    })?;
    args.print
        .print(&outcome, |outcome| outcome.table(&hyperparameters))
}

/// The likelihood of one joint.
struct Job<'a> {
    args: &'a Args,
    hyperparameters: &'a Hyperparameters,
    /// Between states.
    covariance: &'a TorqueCovariance,
}

impl Job<'_> {
    /// The rows; if the hyperparameters name contexts, those of all of them.
    fn read(&self, mut table: Table, columns: &DataColumns) -> Result<Data, CliError> {
        let DataArgs { path, context, .. } = &self.args.data;
        let Some(contexts) = &self.hyperparameters.contexts else {
            return columns.read(&mut table, context.as_deref());
        };
        let whose = self.args.hyperparameters.display().to_string();
        if let Some(context) = context {
            return Err(CliError::Usage(format!(
                "--context {context}: {whose} has `contexts`, so that rows of all of them are taken"
            )));
        }
        let header = table.column_names();
        let column = ContextColumn::of_known(table.file(), &header, contexts, &whose)?;
        let data = columns.read_all(&mut table, column)?;
        let numbers = &data.samples.context_of;
        if let Some(absent) = (0..contexts.len()).find(|number| !numbers.contains(number)) {
            let absent = &contexts[absent];
            let path = path.display();
            return Err(CliError::Hyperparameters {
                file: whose,
                reason: format!(
                    "`contexts`: `{absent}` has no row in {path}; leave it and its row of `task_factor` out"
                ),
            });
        }
        Ok(data)
    }

    fn outcome(&self, samples: &Samples) -> Result<Outcome, TorqueError> {
        let evidence = self.evidence(samples)?;
        Ok(Outcome {
            log_marginal_likelihood: evidence.evaluation.log_marginal_likelihood,
            gradient: (self.hyperparameters).named(self.covariance, &evidence.gradient),
            error_bound: evidence.evaluation.error_bound,
            method: evidence.evaluation.method.to_string(),
            rank: evidence.evaluation.rank,
        })
    }

    fn evidence(&self, samples: &Samples) -> Result<Evidence, TorqueError> {
        let options = LikelihoodOptions {
            method: self.args.method.method(),
            ..LikelihoodOptions::automatic()
        };
        let (x, torques) = (samples.x.as_ref(), &samples.torques[0].values);
        let noise_std = self.hyperparameters.noise_std.values();
        let Some(prior) = self.hyperparameters.task_covariance(self.covariance)? else {
            return Ok(evidence(
                self.covariance,
                noise_std[0],
                x,
                torques,
                options,
            )?);
        };
        let data = Stacked::new(x, &samples.context_of, prior.n_tasks())?;
        let targets = data.stack(torques);
        match &self.hyperparameters.noise_std {
            NoiseStd::Shared(noise_std) => Ok(evidence(
                &prior,
                *noise_std,
                data.inputs(),
                &targets,
                options,
            )?),
            NoiseStd::OfContexts(noise_std) => {
                let noise = TaskNoise::new(prior, noise_std.clone())?;
                Ok(noise.evidence(&data, &targets, options)?)
            }
        }
    }
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
