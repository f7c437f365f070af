//! `torque-gp inverse-dynamics`: a CSV of states in, a CSV of torques out, row by row.

use std::path::{Path, PathBuf};

use puma_dyn::dynamics::{Hysteresis, rnea_with_hysteresis, torque_terms_with_hysteresis};
use puma_dyn::{Context, Friction, TorqueTerms, Workspace};

use crate::columns::StateColumns;
use crate::degrees::DegreesWatch;
use crate::error::CliError;
use crate::joints::Joints;
use crate::messages;
use crate::output::{self, Output};
use crate::payload_file;
use crate::result_table::{self, ResultTable};
use crate::robot::{Robot, RobotArgs};
use crate::run_clock::RunClock;
use crate::table::{Row, Table};

/// Torques of a robot for every row of a CSV of joint positions, speeds and accelerations
///
/// INPUT has a header with q1..qN, qd1..qdN, qdd1..qddN (or `q_<joint>`, …), in any column
/// order, and one row per sample; other columns are copied to the output as they are.
/// OUTPUT has those columns, then tau1..tauN (or `tau_<joint>`), one row per input row, in digits that read back exactly.
/// Numbers are rad, rad/s, rad/s² and N·m; m, m/s, m/s² and N for sliding joints.
///
/// What is in the torques: rigid bodies, gravity and the payload always; friction by --friction; rotor inertia
/// unless --no-rotor-inertia.
/// Friction with memory (`hysteresis` in the sidecar) needs a column t (s); it begins at zero with every run, which is
/// where `context` or `run` changes or, without these columns, where t falls.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    #[command(flatten)]
    robot: RobotArgs,

    /// A load fixed to the last link: mass, centre, and inertia or size (see below)
    #[arg(long, value_name = "FILE.toml")]
    payload: Option<PathBuf>,

    /// States; `-` is standard input
    #[arg(long, value_name = "FILE.csv")]
    input: PathBuf,

    /// Torques; `-` is standard output
    #[arg(long, value_name = "FILE.csv")]
    output: PathBuf,

    /// Copy the state columns to the output as well
    #[arg(long)]
    keep_states: bool,

    /// Add the terms of every torque: tau1_inertia, _coriolis, _gravity, _payload, _friction, _rotor
    #[arg(long)]
    terms: bool,

    /// Start of the torque columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    tau_prefix: String,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp inverse-dynamics --robot puma560 --input states.csv --output torques.csv
  torque-gp inverse-dynamics --robot arm.urdf --sidecar motors.toml --payload tool.toml \\
      --input log.csv --output torques.csv --terms
  cat states.csv | torque-gp inverse-dynamics --robot puma560 --friction none --input - --output -

Payload file:
  mass = 2.0                            # kg
  centre = [0.0, 0.0, 0.1]              # m, centre of mass in the axes of the link's frame
  inertia = [0.02, 0.02, 0.01, 0, 0, 0] # kg m², about the centre: xx, yy, zz, xy, xz, yz
  # or a homogeneous cuboid instead of `inertia`:
  # size = [0.1, 0.2, 0.3]              # m, edges
  # rpy = [0.0, 0.0, 0.0]               # rad, roll, pitch, yaw of the cuboid in the link's frame
  # link = \"tool0\"                      # default: the link that the last joint moves

Sidecar file (every key optional):
  friction_convention = \"modern\"        # or \"toolbox-2008\", \"none\"
  [joint.shoulder]                      # a joint of the URDF
  gear_ratio = -62.6                    # motor speed / joint speed, signed
  rotor_inertia = 200e-6                # kg m², motor side
  viscous_motor = 1.5e-3                # N m s/rad, motor side
  coulomb_motor_positive = 0.4          # N m, motor side, for qd > 0
  coulomb_motor_negative = -0.4         # N m, motor side, for qd < 0
  tanh = [{ width = 0.02, torque = 1.5 }]                   # rad/s, N m: torque tanh(qd/width)
  hysteresis = [{ length = 5e-4, torque = 2.0 }]            # rad, N m: friction that remembers its travel
  load_hysteresis = [{ length = 5e-4, coefficient = 0.05 }] # the same as a part of the rigid-body torque
  load_viscous = 0.08                                       # s/rad, viscous friction as a part of it
  offset = 0.3                                              # N m

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads the states, writes the torques.
///
/// # Errors
/// Anything wrong with the options or a file; no output is left.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut inputs = args.robot.request().files();
    inputs.push(&args.input);
    inputs.extend(args.payload.as_deref());
    output::check_not_an_input(&args.output, &inputs)?;
    check_is_csv(&args.output)?;

    let robot = args.robot.request().load()?;
    let context = match &args.payload {
        Some(path) => payload_file::load(path, &robot)?,
        None => Context::empty(),
    };
    let table = Table::open(&args.input)?;
    let columns = StateColumns::find(
        table.file(),
        &table.column_names(),
        &Joints::of_robot(&robot.model),
    )?;
    warn_of_strangers(table.file(), &columns);
    let mut job = Job::new(args, &robot, &context, &table, columns)?;
    let mut output = Output::create(&args.output)?;
    let n_rows = job.convert(table, &mut output)?;

    job.degrees.doubts().into_iter().for_each(messages::warning);
    let (name, load) = (
        output.name().to_owned(),
        if args.payload.is_some() {
            "with the payload"
        } else {
            "no payload"
        },
    );
    output.commit()?;
    messages::note(format!(
        "{n_rows} rows written to {name} ({}, {load})",
        robot.effects_in_words()
    ));
    Ok(())
}

/// Everything that one row needs.
struct Job<'a> {
    robot: &'a Robot,
    context: &'a Context,
    columns: StateColumns,
    result: ResultTable,
    degrees: DegreesWatch,
    workspace: Workspace,
    clock: Option<RunClock>,
    hysteresis: Hysteresis,
    terms: Option<TorqueTerms>,
    x: Vec<f64>,
    tau: Vec<f64>,
}

impl<'a> Job<'a> {
    fn new(
        args: &Args,
        robot: &'a Robot,
        context: &'a Context,
        table: &Table,
        columns: StateColumns,
    ) -> Result<Self, CliError> {
        let model = &robot.model;
        let n_joints = model.n_joints();
        if n_joints == 0 {
            return Err(CliError::Usage("the robot has no moving joint".to_owned()));
        }
        let terms = args.terms.then(|| TorqueTerms::new(model));
        let torques = columns
            .naming
            .columns(&args.tau_prefix, model.joint_names());
        let mut added = torques.clone();
        for (term, _) in terms.iter().flat_map(TorqueTerms::named) {
            added.extend(torques.iter().map(|torque| format!("{torque}_{term}")));
        }
        let result = ResultTable::new(table, &columns, args.keep_states, added)?;
        Ok(Self {
            robot,
            context,
            degrees: DegreesWatch::new(model, &columns.states[..n_joints]),
            columns,
            result,
            workspace: Workspace::new(model),
            clock: clock(robot, table)?,
            hysteresis: Hysteresis::new(model),
            terms,
            x: vec![0.0; 3 * n_joints],
            tau: vec![0.0; n_joints],
        })
    }

    /// Reads all rows and writes as many; returns their number.
    fn convert(&mut self, mut table: Table, output: &mut Output) -> Result<u64, CliError> {
        let mut n_rows = 0;
        self.result.write_header(output)?;
        let file = output.name().to_owned();
        while let Some(row) = table.next_row()? {
            self.torques(row)?;
            self.write_row(row, output)
                .map_err(CliError::io("write", file.clone()))?;
            n_rows = row.number;
        }
        Ok(n_rows)
    }

    /// The torques of one row, into `tau` and `terms`.
    fn torques(&mut self, row: Row<'_>) -> Result<(), CliError> {
        for (value, column) in self.x.iter_mut().zip(&self.columns.states) {
            *value = row.number(column)?;
        }
        let n_joints = self.tau.len();
        let (q, rates) = self.x.split_at(n_joints);
        let (qd, qdd) = rates.split_at(n_joints);
        self.degrees.see(q);
        if let Some(clock) = &mut self.clock {
            match clock.elapsed(row)? {
                Some(step) => self.hysteresis.advance(qd, step),
                None => self.hysteresis.reset(),
            }
        }
        let Robot { model, effects, .. } = self.robot;
        rnea_with_hysteresis(
            model,
            &mut self.workspace,
            *effects,
            self.context,
            &self.hysteresis,
            q,
            qd,
            qdd,
            &mut self.tau,
        );
        if let Some(terms) = &mut self.terms {
            torque_terms_with_hysteresis(
                model,
                &mut self.workspace,
                *effects,
                self.context,
                &self.hysteresis,
                q,
                qd,
                qdd,
                terms,
            );
        }
        Ok(())
    }

    fn write_row(&self, row: Row<'_>, output: &mut Output) -> std::io::Result<()> {
        let terms = self.terms.iter().flat_map(TorqueTerms::named);
        let numbers = std::iter::once(&self.tau[..]).chain(terms.map(|(_, values)| values));
        result_table::write_row(self.result.copied_fields(row), numbers.flatten(), output)
    }
}

/// What tells the time between rows, for friction that has memory.
fn clock(robot: &Robot, table: &Table) -> Result<Option<RunClock>, CliError> {
    if robot.effects.friction == Friction::None || !robot.model.has_hysteresis() {
        return Ok(None);
    }
    let why = "the sidecar states friction with hysteresis, which depends on how long the joints have moved; \
               --friction none leaves it out";
    RunClock::find(table.file(), &table.column_names(), why).map(Some)
}

fn check_is_csv(path: &Path) -> Result<(), CliError> {
    if path
        .extension()
        .is_some_and(|extension| extension == "parquet")
    {
        let reason = format!(
            "--output {}: inverse-dynamics writes CSV; simulate writes Parquet too",
            path.display()
        );
        return Err(CliError::Usage(reason));
    }
    Ok(())
}

fn warn_of_strangers(file: &str, columns: &StateColumns) {
    if !columns.strangers.is_empty() {
        let names = columns.strangers.join(", ");
        messages::warning(format!(
            "{file}: copied, not used, because the robot has no such joint: {names}"
        ));
    }
}
