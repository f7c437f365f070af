//! `torque-gp control`: a robot that follows a motion under the composite controller, simulated.

use std::path::{Path, PathBuf};

use puma_dyn::Context;
use puma_dyn::motion::{ClosedLoop, Rate, Tick};

use crate::columns::Naming;
use crate::commands::control::feed_forward::{Asked, Source};
use crate::commands::control::gains::GainArgs;
use crate::commands::control::reference::Reference;
use crate::commands::control::summary::{Summary, Tally};
use crate::error::CliError;
use crate::messages;
use crate::output::{self, Output};
use crate::payload_file;
use crate::printed::PrintArgs;
use crate::result_table;
use crate::robot::{Robot, RobotArgs};

/// A robot that follows a motion: feed-forward torques and a correction, simulated with friction that holds and slips
///
/// ```text
/// tau = tau_ff + Kp (q_desired - q) + Kd (qd_desired - qd)      held from one tick to the next
/// ```
/// REFERENCE has a column t (s, ascending) and states q1..qN, qd1..qdN, qdd1..qddN (or q_<joint>, …); between its rows
/// the motion is the polynomial of degree five that has the rows' positions, speeds and accelerations.
/// The robot starts on it.
/// OUTPUT has t, q, qd, error (desired − actual), tau and tau_ff of every joint, one row per tick.
/// The summary says of every joint: RMS and largest error, RMS torque, and the part of it that is corrective.
#[derive(clap::Args, Debug)]
#[command(verbatim_doc_comment, after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    robot: RobotArgs,

    /// A load that the robot carries: mass, centre, and inertia or size (see `inverse-dynamics --help`)
    #[arg(long, value_name = "FILE.toml")]
    payload: Option<PathBuf>,

    /// The motion to follow; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    reference: PathBuf,

    /// Torques before there is any error: none, gravity (of robot and load), exact (the simulated robot and load), or
    /// those of a model file
    #[arg(long, value_name = "none|gravity|exact|FILE.tgp")]
    feed_forward: PathBuf,

    /// Context of a model of several
    #[arg(long, value_name = "NAME")]
    context: Option<String>,

    /// Load that the model file is asked for, by its data sheet: see `predict --help`
    #[arg(long, value_name = "FILE.toml", conflicts_with = "context")]
    model_payload: Option<PathBuf>,

    #[command(flatten)]
    gains: GainArgs,

    /// Ticks of the controller per second
    #[arg(long, value_name = "HZ", default_value_t = 1000.0)]
    rate: f64,

    /// Steps of the integration from one tick to the next
    #[arg(long, value_name = "N", default_value_t = 2)]
    steps: usize,

    /// What happened, tick by tick
    #[arg(long, value_name = "FILE.csv")]
    output: Option<PathBuf>,

    #[command(flatten)]
    print: PrintArgs,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp simulate --load c3 --path p2 --speed s4 --output run.csv
  torque-gp control --robot puma560 --payload c3.toml --reference run.csv --feed-forward exact --bandwidth 8
  torque-gp control --robot puma560 --payload c3.toml --reference run.csv --feed-forward mgp.tgp --context c3 \\
      --bandwidth 8 --output ticks.csv
  torque-gp control --robot puma560 --payload new.toml --reference run.csv --feed-forward mgp.tgp \\
      --model-payload new.toml --bandwidth 8
  torque-gp control --robot arm.urdf --reference run.csv --feed-forward gravity --kp 80,60 --kd 8,6 --json

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Simulates the run and prints what came of it.
///
/// # Errors
/// Anything wrong with the options or a file, and a motion that diverges; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    let rate = args.rate()?;
    if let Some(output) = &args.output {
        check_output(output)?;
        output::check_not_an_input(output, &args.inputs())?;
    }
    let robot = args.robot.request().load()?;
    let payload = match &args.payload {
        Some(path) => payload_file::load(path, &robot)?,
        None => Context::empty(),
    };
    let reference = Reference::read(&args.reference, &robot.model)?;
    let asked = Asked {
        context: args.context.as_deref(),
        payload: args.model_payload.as_deref(),
    };
    let mut source = Source::open(&args.feed_forward, asked, &robot, &payload, &reference)?;
    let controller = args.gains.controller(&robot, &reference)?;

    let (model, effects) = (&robot.model, robot.effects);
    let motion = &reference.motion;
    let mut simulated = ClosedLoop::new(model, effects, payload, motion, rate)?;
    let mut output = args.output.as_deref().map(Output::create).transpose()?;
    if let Some(output) = &mut output {
        write_header(&robot, reference.naming, output)?;
    }
    let mut tally = Tally::new(model.n_joints());
    let mut failure = None;
    let outcome = simulated.run(&controller, &mut source, f64::INFINITY, |tick| {
        tally.add(tick);
        if let (Some(output), None) = (&mut output, &failure) {
            failure = write_tick(motion.start(), tick, output).err();
        }
    });
    outcome.map_err(|stop| source.why(stop))?;
    if let Some(failure) = failure {
        return Err(failure);
    }
    if let Some(output) = output {
        let name = output.name().to_owned();
        output.commit()?;
        messages::note(format!("{} ticks written to {name}", simulated.n_ticks()));
    }
    let summary = tally.summary(model.joint_names(), &controller);
    args.print.print(&summary, Summary::to_text)
}

impl Args {
    fn inputs(&self) -> Vec<&Path> {
        let mut inputs = self.robot.request().files();
        inputs.extend([self.reference.as_path(), self.feed_forward.as_path()]);
        inputs.extend(self.payload.as_deref());
        inputs.extend(self.model_payload.as_deref());
        inputs
    }

    fn rate(&self) -> Result<Rate, CliError> {
        if !(self.rate.is_finite() && self.rate > 0.0) {
            let reason = format!("--rate {}: ticks per second must be positive", self.rate);
            return Err(CliError::Usage(reason));
        }
        if self.steps == 0 {
            return Err(CliError::Usage(
                "--steps 0: at least one is needed".to_owned(),
            ));
        }
        Ok(Rate {
            period: self.rate.recip(),
            n_steps: self.steps,
        })
    }
}

fn check_output(output: &Path) -> Result<(), CliError> {
    if output == Path::new("-") {
        let reason = "--output -: standard output has the summary; name a file for the ticks";
        return Err(CliError::Usage(reason.to_owned()));
    }
    Ok(())
}

/// Quantities of the output, in order, each with a column for every joint.
const QUANTITIES: [&str; 5] = ["q", "qd", "error", "tau", "tau_ff"];

fn write_header(robot: &Robot, naming: Naming, output: &mut Output) -> Result<(), CliError> {
    let names = robot.model.joint_names();
    let columns = QUANTITIES
        .iter()
        .flat_map(|quantity| naming.columns(quantity, names));
    let header: Vec<String> = std::iter::once("t".to_owned()).chain(columns).collect();
    let (texts, name) = (header.iter().map(String::as_str), output.name().to_owned());
    result_table::write_row(texts, std::iter::empty(), output).map_err(CliError::io("write", name))
}

fn write_tick(start: f64, tick: &Tick<'_>, output: &mut Output) -> Result<(), CliError> {
    let positions = tick.desired.q.iter().zip(tick.q);
    let errors: Vec<f64> = positions.map(|(desired, q)| desired - q).collect();
    let time = start + tick.time;
    let quantities = [tick.q, tick.qd, &errors, tick.tau, tick.feed_forward];
    let numbers = std::iter::once(&time).chain(quantities.into_iter().flatten());
    let name = output.name().to_owned();
    result_table::write_row(std::iter::empty(), numbers, output)
        .map_err(CliError::io("write", name))
}
