//! The options of `torque-gp fit`.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::str::FromStr;

use clap::ValueEnum;
use mtgp::Criterion;
use torque_model::rigid_body::TermSet;

use crate::continuous::ContinuousArgs;
use crate::data_args::DataArgs;
use crate::error::CliError;
use crate::method::MethodArg;
use crate::robot::OptionalRobotArgs;

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
    pub data: DataArgs,

    /// What is learned
    #[arg(long, value_enum, default_value_t = ModelArg::Gpc)]
    pub model: ModelArg,

    /// Joints to learn, by number or name [default: all with a torque column]
    #[arg(long, value_name = "JOINT,…", value_delimiter = ',')]
    pub joints: Vec<String>,

    #[command(flatten)]
    pub continuous: ContinuousArgs,

    /// Rank of the matrix that relates the contexts (mgp): a number, or bic to choose one by the criterion
    /// [default: bic]
    #[arg(long, value_name = "bic|R")]
    pub rank: Option<RankArg>,

    /// Criterion that chooses the rank (mgp) [default: bic]
    #[arg(long, value_enum)]
    pub criterion: Option<CriterionArg>,

    /// Folder with what is carried in each context, NAME.toml for context NAME (mgp): mass, centre, and inertia or size
    /// (see `inverse-dynamics --help`); loads are then related by their mass and first moments alone, and
    /// `predict --payload` is for any load
    #[arg(long, value_name = "DIR")]
    pub payloads: Option<PathBuf>,

    /// Contexts in which the robot carries nothing (rbd, and mgp with --payloads); without, what rbd describes may carry
    /// a tool
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    pub bare: Vec<String>,

    /// Terms of the friction that is learned (rbd) [default: auto]
    #[arg(long, value_enum)]
    pub friction_terms: Option<FrictionTermsArg>,

    /// From where the search for hyperparameters sets out (not lr and lrc)
    #[arg(long, value_enum, default_value_t = StartsArg::Several)]
    pub starts: StartsArg,

    /// The chapter's fixed values and bounds, which are for an arm's torques in N·m: a variance of the noise of 10⁻⁴ and
    /// of each weight of 10⁴ (lr, lrc); of the noise of at least 10⁻⁴, and u of at most 100 (other models but rbd and
    /// rbd+gp) [default: all of them follow the data]
    #[arg(long)]
    pub chapter: bool,

    /// Learn from all rows as if each told something of its own, however close in time they are; without, of a log with
    /// a column t, processes learn from rows at least 0.3 s apart, and rows of lr and lrc count by their correlation
    #[arg(long)]
    pub all_rows: bool,

    /// How likelihoods are computed (not lr and lrc)
    #[arg(long, value_enum, default_value_t = MethodArg::Automatic)]
    pub method: MethodArg,

    /// Joints learned at a time [default: one per processor]
    #[arg(long, value_name = "N")]
    pub threads: Option<NonZeroUsize>,

    /// Model file
    #[arg(long, value_name = "FILE.tgp")]
    pub output: PathBuf,

    #[command(
        flatten,
        next_help_heading = "Robot (rbd and rbd+gp; for gpc, gp, mgp, igp and pgp which of its joints are continuous)"
    )]
    pub robot: OptionalRobotArgs,
}

/// The models of one joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ModelArg {
    /// Gaussian process with Coulomb friction: the most accurate
    Gpc,
    /// Gaussian process without Coulomb friction
    Gp,
    /// Linear regression with the signs of the speeds (Coulomb friction)
    Lrc,
    /// Linear regression
    Lr,
    /// Parameters of --robot's links, of each load and of friction, about their described values: for real robots
    Rbd,
    /// Parameters of links and drives, and a Gaussian process on what they leave, for one load
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
    pub fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or(String::new(), |value| value.get_name().to_owned())
    }

    /// Whether it learns the parameters of a robot.
    pub fn is_of_robot(self) -> bool {
        matches!(self, Self::Rbd | Self::RbdGp)
    }

    /// Whether it is linear in the state.
    pub fn is_linear(self) -> bool {
        matches!(self, Self::Lr | Self::Lrc)
    }

    /// Whether it has a process, which sees states as they are.
    pub fn has_process(self) -> bool {
        !matches!(self, Self::Lr | Self::Lrc | Self::Rbd)
    }

    /// Whether it learns several contexts together.
    pub fn is_of_many_contexts(self) -> bool {
        matches!(self, Self::Mgp | Self::Igp | Self::Pgp)
    }
}

/// Which terms friction is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum FrictionTermsArg {
    /// For each joint the fewest that predict runs left out about as well as any
    #[default]
    Auto,
    /// Rotor, viscous, and a torque for each direction, which jumps: exact where friction is simulated so
    Signs,
    /// Rotor, viscous, and a smooth change of direction
    Tanh,
    /// The same with an offset, a wider change of direction, and friction that remembers (needs the column t)
    Minimal,
    /// The same with friction that grows with the load
    Standard,
    /// The same with more widths and a longer memory
    Full,
}

impl FrictionTermsArg {
    /// The library's name for it; none to choose.
    pub fn terms(self) -> Option<TermSet> {
        match self {
            Self::Auto => None,
            Self::Signs => Some(TermSet::Signs),
            Self::Tanh => Some(TermSet::Tanh),
            Self::Minimal => Some(TermSet::Minimal),
            Self::Standard => Some(TermSet::Standard),
            Self::Full => Some(TermSet::Full),
        }
    }
}

/// How the rank of K^ρ is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RankArg {
    /// By the criterion.
    Bic,
    /// Given.
    Given(usize),
}

impl FromStr for RankArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("bic", _) => Ok(Self::Bic),
            (_, Ok(rank)) if rank > 0 => Ok(Self::Given(rank)),
            _ => Err("a rank is a number from 1, or bic to choose one".to_owned()),
        }
    }
}

/// What a further rank has to earn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum CriterionArg {
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
    pub fn criterion(self) -> Criterion {
        match self {
            Self::Bic => Criterion::Bic,
            Self::Aic => Criterion::Aic,
            Self::Hq => Criterion::HannanQuinn,
        }
    }
}

/// From where a search sets out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum StartsArg {
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
  torque-gp fit --data runs.csv --model mgp --payloads loads --bare free --output model.tgp
  torque-gp fit --data log.csv --model rbd+gp --robot arm.urdf --output model.tgp
  torque-gp fit --data log.csv --joints shoulder,elbow --starts chapter --threads 1 --output model.tgp

Then:
  torque-gp predict --model model.tgp --input states.csv --output torques.csv
  torque-gp evaluate --model model.tgp --data test.csv

Standard error has a line per finished joint, beyond 512 samples one for what each search begins with, and a table of the fits at the end: log marginal likelihood in nats
(natural log, summed over the samples), the start that won, likelihoods computed, the noise found, bounds hit.

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

impl Args {
    /// Whether rows are taken for independent, however close in time they are.
    pub fn takes_all_rows(&self) -> bool {
        self.chapter || self.all_rows
    }

    /// Refuses options that do not go together.
    ///
    /// # Errors
    /// Which do not.
    pub fn check(&self) -> Result<(), CliError> {
        let model = self.model.name();
        let needs_robot = self.model.is_of_robot();
        let is_ranked = self.model == ModelArg::Mgp;
        let reason = match (self.rank, self.criterion) {
            _ if self.robot.request().is_some() && !needs_robot && !self.model.has_process() => {
                format!(
                    "--robot goes with --model rbd and rbd+gp, and with gpc, gp, mgp, igp and pgp for its continuous \
                     joints, not {model}"
                )
            }
            _ if self.continuous.is_given() && !self.model.has_process() => {
                format!("--continuous goes with gpc, gp, mgp, igp, pgp and rbd+gp, not {model}")
            }
            _ if self.chapter && needs_robot => {
                format!("--chapter goes with all models but rbd and rbd+gp, not {model}")
            }
            _ if self.all_rows && self.model == ModelArg::Rbd => {
                format!(
                    "--all-rows goes with all models but rbd, which counts rows by their correlation, not {model}"
                )
            }
            _ if self.payloads.is_some() && self.model != ModelArg::Mgp => {
                format!("--payloads goes with --model mgp, not {model}")
            }
            (rank, criterion) if self.payloads.is_some() && (rank, criterion) != (None, None) => {
                "--payloads relates the contexts by their loads, which has no rank: leave --rank and --criterion out"
                    .to_owned()
            }
            _ if !self.bare.is_empty() && self.model == ModelArg::Mgp && self.payloads.is_none() => {
                "--bare goes with --model mgp only beside --payloads".to_owned()
            }
            _ if !self.bare.is_empty()
                && !matches!(self.model, ModelArg::Rbd | ModelArg::Mgp) =>
            {
                format!("--bare goes with --model rbd, not {model}")
            }
            _ if self.friction_terms.is_some() && self.model != ModelArg::Rbd => {
                format!("--friction-terms goes with --model rbd, not {model}")
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
}
