//! `torque-gp fit`: learns joint torques from a CSV of measured states and torques.

mod many_contexts;
mod one_context;
mod report;
mod rigid_body;
mod side_by_side;

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;

use clap::ValueEnum;
use gp_core::Provenance;
use mtgp::Criterion;
use sha2::{Digest, Sha256};

use crate::commands::fit::many_contexts::RankArg;
use crate::data_args::DataArgs;
use crate::error::CliError;
use crate::joints::Joints;
use crate::messages;
use crate::method::MethodArg;
use crate::output::{self, Output};
use crate::robot::{OptionalRobotArgs, RobotRequest};
use crate::samples::{DataColumns, JointTorques, Samples};
use crate::score::is_constant;
use crate::table::{self, Table};

/// Rows of data above which the memory of a fit is worth a word: two matrices of 1 GB.
const MANY_ROWS: usize = 11_000;

/// Rows of data beyond which a process has a low rank, of up to `LARGEST_RANK`, or none at all.
const LARGEST_DENSE: usize = 16_384;
const LARGEST_RANK: usize = 2048;

/// Bytes of a fit, roughly: two matrices of order n, or seven with so many columns as the rank.
fn most_bytes(n_rows: usize) -> f64 {
    let entries = if n_rows > LARGEST_DENSE {
        7 * n_rows * LARGEST_RANK
    } else {
        2 * n_rows * n_rows
    };
    8.0 * entries as f64
}

/// Learn joint torques from measured states and torques, for one load or several
///
/// DATA has a header with q1..qN, qd1..qdN, qdd1..qddN and tau1..tauN (or q_<joint>, …, tau_<joint>), in any column
/// order, and one row per sample; other columns are ignored.
/// Joints are those of the state columns, in file order; torques may be there for some of them only.
/// Numbers are rad, rad/s, rad/s² and N·m; m, m/s, m/s² and N for sliding joints.
///
/// A model is for one load, and a column `context` with several needs --context; but mgp, igp and pgp learn all loads
/// together and predict each.
/// Every joint is learned by itself, several at a time; the result is the same, bit by bit, for any --threads.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    data: DataArgs,

    /// What is learned
    #[arg(long, value_enum, default_value_t = ModelArg::Gpc)]
    model: ModelArg,

    /// Joints to learn, by number or name [default: all with a torque column]
    #[arg(long, value_name = "JOINT,…", value_delimiter = ',')]
    joints: Vec<String>,

    /// Rank of the matrix that relates the contexts (mgp): a number, or bic to choose one by the criterion
    /// [default: bic]
    #[arg(long, value_name = "bic|R")]
    rank: Option<RankArg>,

    /// Criterion that chooses the rank (mgp) [default: bic]
    #[arg(long, value_enum)]
    criterion: Option<CriterionArg>,

    /// From where the search for hyperparameters sets out (not lr and lrc)
    #[arg(long, value_enum, default_value_t = StartsArg::Several)]
    starts: StartsArg,

    /// How likelihoods are computed (not lr and lrc)
    #[arg(long, value_enum, default_value_t = MethodArg::Automatic)]
    method: MethodArg,

    /// Joints learned at a time [default: one per processor]
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,

    /// Model file
    #[arg(long, value_name = "FILE.tgp")]
    output: PathBuf,

    #[command(flatten, next_help_heading = "Robot (rbd and rbd+gp)")]
    robot: OptionalRobotArgs,
}

/// The models of one joint.
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
    /// Parameters of --robot's links and drives, uncertain about their described values
    Rbd,
    /// The same, and a Gaussian process on what they leave
    #[value(name = "rbd+gp")]
    RbdGp,
    /// Gaussian process of several contexts whose relation is learned: the most accurate for them
    Mgp,
    /// Gaussian process of several contexts that share their hyperparameters only
    Igp,
    /// Gaussian process that takes several contexts for one
    Pgp,
}

impl ModelArg {
    /// Name as in the options.
    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or(String::new(), |value| value.get_name().to_owned())
    }

    fn has_rigid_body_prior(self) -> bool {
        matches!(self, Self::Rbd | Self::RbdGp)
    }

    fn is_of_many_contexts(self) -> bool {
        matches!(self, Self::Mgp | Self::Igp | Self::Pgp)
    }
}

/// What a further rank has to earn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum CriterionArg {
    /// Bayesian: ½ log n nats for each hyperparameter
    #[default]
    Bic,
    /// Akaike: 1 nat
    Aic,
    /// Hannan–Quinn: log log n nats
    Hq,
}

impl CriterionArg {
    /// The library's name for it.
    fn criterion(self) -> Criterion {
        match self {
            Self::Bic => Criterion::Bic,
            Self::Aic => Criterion::Aic,
            Self::Hq => Criterion::HannanQuinn,
        }
    }
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
  torque-gp fit --data runs.csv --model mgp --rank 4 --output model.tgp
  torque-gp fit --data log.csv --model rbd+gp --robot arm.urdf --output model.tgp
  torque-gp fit --data log.csv --joints shoulder,elbow --starts chapter --threads 1 --output model.tgp

Then:
  torque-gp predict --model model.tgp --input states.csv --output torques.csv
  torque-gp evaluate --model model.tgp --data test.csv

Standard error has a line per finished joint, beyond 512 samples one for what each search begins with, and a table of the fits at the end: log marginal likelihood in nats
(natural log, summed over the samples), the start that won, likelihoods computed, the noise found, bounds hit.

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads the data, learns every joint, writes the model.
///
/// # Errors
/// Anything wrong with the options or the data, or a joint that cannot be learned; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut inputs = args.robot.request().map_or(Vec::new(), RobotRequest::files);
    inputs.push(&args.data.path);
    output::check_not_an_input(&args.output, &inputs)?;
    let (file, bytes) = table::read_bytes(&args.data.path)?;
    let data_sha256 = Sha256::digest(&bytes).into();
    let table = Table::from_bytes(file, bytes)?;
    check_options(args)?;
    let robot = match args.robot.request() {
        None => None,
        Some(request) => {
            let robot = request.load()?;
            Some((request.source()?, robot))
        }
    };
    let (prefix, option, asked) = (&args.data.tau_prefix, "--joints", &args.joints);
    let columns = match &robot {
        None => DataColumns::of_header(&table, prefix, option, asked),
        Some((_, robot)) => {
            let joints = Joints::of_robot(&robot.model);
            DataColumns::of_robot(&table, joints, prefix, option, asked)
        }
    }?;
    let mut output = Output::create(&args.output)?;
    let bytes = match &robot {
        Some((source, robot)) => {
            rigid_body::learn(args, source.clone(), robot, table, &columns, data_sha256)?
        }
        None if args.model.is_of_many_contexts() => {
            many_contexts::learn(args, table, &columns, data_sha256)?
        }
        None => one_context::learn(args, table, &columns, data_sha256)?,
    };
    let name = output.name().to_owned();
    output
        .write_all(&bytes)
        .map_err(CliError::io("write", name.clone()))?;
    output.commit()?;
    messages::note(format!("{name} written"));
    Ok(())
}

/// Refuses options that do not go together.
fn check_options(args: &Args) -> Result<(), CliError> {
    let (is_ranked, model) = (args.model == ModelArg::Mgp, args.model.name());
    let (needs_robot, has_robot) = (
        args.model.has_rigid_body_prior(),
        args.robot.request().is_some(),
    );
    let reason = match (args.rank, args.criterion) {
        _ if needs_robot && !has_robot => {
            format!(
                "--model {model} needs the robot whose parameters it learns: --robot FILE.urdf or puma560"
            )
        }
        _ if has_robot && !needs_robot => {
            format!("--robot goes with --model rbd and rbd+gp, not {model}")
        }
        (Some(_), _) if !is_ranked => format!("--rank goes with --model mgp, not {model}"),
        (_, Some(_)) if !is_ranked => format!("--criterion goes with --model mgp, not {model}"),
        (Some(RankArg::Given(rank)), Some(_)) => {
            format!("--criterion chooses a rank, but --rank {rank} gives one")
        }
        _ => return Ok(()),
    };
    Err(CliError::Usage(reason))
}

/// Name of the file and its samples of one context, after [`check`].
fn read_context(
    args: &Args,
    table: Table,
    columns: &DataColumns,
) -> Result<(String, Samples), CliError> {
    let file = table.file().to_owned();
    let samples = columns.read(table, args.data.context.as_deref())?;
    check(&file, &samples, columns)?;
    Ok((file, samples))
}

/// Where a model comes from that this program learns.
fn provenance(data_sha256: [u8; 32], robot_sha256: Option<[u8; 32]>, context: &str) -> Provenance {
    Provenance {
        data_sha256,
        robot_sha256,
        program: concat!("torque-gp ", env!("CARGO_PKG_VERSION")).to_owned(),
        context: context.to_owned(),
    }
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
        let gigabytes = most_bytes(n_rows) / 1e9;
        messages::warning(format!(
            "{file}: {n_rows} rows: a Gaussian process may take {gigabytes:.0} GB for each joint learned at a time"
        ));
    }
    Ok(())
}
