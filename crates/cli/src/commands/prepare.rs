//! `torque-gp prepare`: a log as a robot wrote it, made into samples to learn from.

use std::io::Write;
use std::path::{Path, PathBuf};

use robot_log::{
    Columns, DelimitedText, EffortUnit, HYSTERESIS_LENGTHS, Mapping, PositionUnit, PreparedRun,
    Quantity, Recording, Settings, SqliteBag, Tally, TimeUnit, VelocityUnit,
};

use crate::columns::Naming;
use crate::error::CliError;
use crate::messages;
use crate::output::{self, Output};

/// Significant digits of what is written.
const DIGITS: usize = 10;

/// Make a robot's log into samples: even time, low-pass without delay, accelerations
///
/// Reads bags of ROS 2 in SQLite (.db3, joint states) and text in columns: separated by commas, semicolons, tabs or blanks, with decimal points or commas, with a header or
/// without (columns are then called c1, c2, …). The columns are known by their names where these are usual ones, and
/// said by --position, --velocity, --effort, --time or a --mapping otherwise; `{}` stands for a joint's name.
/// The unit of efforts is never guessed.
///
/// Stamps are made even, gaps cut a run in two, rows that hold garbage are dropped and counted. Positions, speeds and
/// torques are filtered by a Butterworth low-pass of order 4 forwards and backwards, before rows are left out;
/// accelerations are the derivative of the filtered speeds, speeds that of the positions where the log has none.
/// The columns written are context, run, t, q, qd, qdd, tau of every joint, z0.5 and z2 (states of friction's memory)
/// and use (whether the joint moves): what `fit` reads.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Logs, each of one run or with a column of labels; a bag's folder stands for its files, each a run
    #[arg(required = true, value_name = "LOG")]
    logs: Vec<PathBuf>,

    /// Samples
    #[arg(long, value_name = "FILE.csv")]
    output: PathBuf,

    /// Write the mapping that the columns' names suggest, to be checked, instead of samples
    #[arg(long)]
    guess: bool,

    /// Which columns are what, and in which units (TOML)
    #[arg(long, value_name = "FILE.toml")]
    mapping: Option<PathBuf>,

    /// Topic of joint states in a bag; without it the only one
    #[arg(long, value_name = "NAME")]
    topic: Option<String>,

    /// Columns of positions, as in `q_{}`, or names with commas between them
    #[arg(long, value_name = "COLUMNS")]
    position: Option<String>,

    /// Columns of speeds; `none` makes them from the positions
    #[arg(long, value_name = "COLUMNS")]
    velocity: Option<String>,

    /// Columns of efforts: torques, or the motors' currents
    #[arg(long, value_name = "COLUMNS")]
    effort: Option<String>,

    /// Column of time; `none` counts rows at the --rate
    #[arg(long, value_name = "COLUMN")]
    time: Option<String>,

    /// Column of the runs' labels
    #[arg(long, value_name = "COLUMN")]
    run: Option<String>,

    /// Column of what the arm carries
    #[arg(long, value_name = "COLUMN", conflicts_with = "context")]
    context_column: Option<String>,

    /// What the arm carries in all of these logs
    #[arg(long, value_name = "NAME")]
    context: Option<String>,

    /// Joints in the order of the arm; without it all that have columns
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    joints: Vec<String>,

    /// rad, deg, turn, mrad, m, mm
    #[arg(long, value_name = "UNIT")]
    position_unit: Option<String>,

    /// rad/s, deg/s, turn/s, rpm, mrad/s, m/s, mm/s
    #[arg(long, value_name = "UNIT")]
    velocity_unit: Option<String>,

    /// Nm, mNm, kNm, N; A, mA with --gain
    #[arg(long, value_name = "UNIT")]
    effort_unit: Option<String>,

    /// s, ms, us, ns
    #[arg(long, value_name = "UNIT")]
    time_unit: Option<String>,

    /// N·m for each ampere, of each joint or one for all
    #[arg(
        long,
        value_name = "GAINS",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    gain: Vec<f64>,

    /// Rate of the log, Hz; without it that of the median step
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,

    /// Cut-off of the low-pass, Hz
    #[arg(long, value_name = "HZ", default_value_t = Settings::default().cut_off)]
    cut_off: f64,

    /// Keep every K-th row; without it ten for each period of the cut-off
    #[arg(long, value_name = "K")]
    every: Option<std::num::NonZeroUsize>,

    /// Leave positions as they were recorded, but for whole turns
    #[arg(long)]
    positions_as_recorded: bool,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp prepare run1.csv run2.csv --effort-unit Nm --output samples.csv
  torque-gp prepare bag.db3 --effort-unit Nm --joints shoulder,elbow,wrist --output samples.csv
  torque-gp prepare log.csv --guess --output mapping.toml
  torque-gp prepare log.csv --mapping mapping.toml --context cube --output samples.csv
  torque-gp prepare gen3.csv --effort 'TorqueCur{}' --effort-unit Nm --time-unit ms --output samples.csv

Exit status: 0, or 2 for bad input or usage; then there is one message and no output file.";

/// Reads logs, writes samples.
///
/// # Errors
/// Logs that cannot be read, columns that are not known, efforts without a unit, time that runs backwards, joints that
/// differ between logs; then nothing is written.
pub fn run(args: &Args) -> Result<(), CliError> {
    args.check()?;
    let inputs: Vec<&Path> = args
        .logs
        .iter()
        .chain(&args.mapping)
        .map(PathBuf::as_path)
        .collect();
    output::check_not_an_input(&args.output, &inputs)?;
    let logs = files_of(&args.logs)?;
    let mapping = args.mapping(&logs[0])?;
    let mut output = Output::create(&args.output)?;
    if args.guess {
        write(&mut output, mapping.to_toml().as_bytes())?;
        return output.commit();
    }
    let settings = args.settings();
    let mut samples = SamplesFile {
        has_context: args.context.is_some() || mapping.context.is_some(),
        joints: Vec::new(),
        output: csv::Writer::from_writer(output),
    };
    let mut tallies = Vec::new();
    for log in &logs {
        let mut log = args.recording(log, &mapping)?;
        samples.take_joints(log.as_ref())?;
        let mut rate = None;
        let tally = robot_log::prepare(log.as_mut(), &settings, |run| {
            rate = Some((run.rate, run.every));
            samples.push(run)
        })?;
        tallies.push((log.file().to_owned(), tally, rate));
    }
    let output = samples.output.into_inner().map_err(|error| CliError::Io {
        action: "write",
        file: args.output.display().to_string(),
        source: error.into_error(),
    })?;
    output.commit()?;
    for (file, tally, rate) in &tallies {
        report(file, tally, *rate, &settings);
    }
    Ok(())
}

impl Args {
    fn check(&self) -> Result<(), CliError> {
        let is_rate = |rate: f64| rate.is_finite() && rate > 0.0;
        match self.rate {
            Some(rate) if !is_rate(rate) => Err(CliError::Usage(format!(
                "--rate {rate}: a number of Hz above 0"
            ))),
            _ if !is_rate(self.cut_off) => Err(CliError::Usage(format!(
                "--cut-off {}: a number of Hz above 0",
                self.cut_off
            ))),
            _ => Ok(()),
        }
    }

    fn settings(&self) -> Settings {
        Settings {
            rate: self.rate,
            cut_off: self.cut_off,
            every: self.every.map(std::num::NonZeroUsize::get),
            filters_positions: !self.positions_as_recorded,
            context: self.context.clone(),
        }
    }

    /// A log of whatever format.
    fn recording(&self, path: &Path, mapping: &Mapping) -> Result<Box<dyn Recording>, CliError> {
        if SqliteBag::is_one(path) {
            let bag = SqliteBag::open(path, self.topic.as_deref(), mapping)?;
            return Ok(Box::new(bag));
        }
        if self.topic.is_some() {
            return Err(CliError::Usage(format!(
                "--topic goes with bags, and {} is none",
                path.display()
            )));
        }
        let text = DelimitedText::open(path)?;
        Ok(Box::new(text.with_mapping(mapping.clone())?))
    }

    /// The file's mapping, or the one that the first log's names suggest.
    fn mapping_to_begin_with(&self, first: &Path) -> Result<Mapping, CliError> {
        if let Some(path) = &self.mapping {
            let file = path.display().to_string();
            let text = std::fs::read_to_string(path).map_err(CliError::io("read", file.clone()))?;
            return Mapping::parse(&text)
                .map_err(|cause| CliError::Usage(format!("{file}: {cause}")));
        }
        if SqliteBag::is_one(first) {
            let columns = [
                &self.position,
                &self.velocity,
                &self.effort,
                &self.time,
                &self.run,
                &self.context_column,
            ];
            if self.guess || columns.iter().any(|option| option.is_some()) {
                return Err(CliError::Usage(format!(
                    "{} is a bag, whose joint states have no columns: leave --guess and the options of columns out",
                    first.display()
                )));
            }
            return Ok(Mapping::default());
        }
        let log = DelimitedText::open(first)?;
        if self.position.is_some() && self.effort.is_some() {
            return Ok(log.guess().unwrap_or_default());
        }
        Ok(log.guess()?)
    }

    /// A mapping, with what the options say instead.
    fn mapping(&self, first: &Path) -> Result<Mapping, CliError> {
        let mut mapping = self.mapping_to_begin_with(first)?;
        if self.mapping.is_none() && self.position.is_some() {
            mapping.joints.clear();
            mapping.velocity = None;
        }
        let columns = |text: &String| (text != "none").then(|| Columns::parse(text));
        if let Some(text) = &self.position {
            mapping.position = columns(text);
        }
        if let Some(text) = &self.velocity {
            mapping.velocity = columns(text);
        }
        if let Some(text) = &self.effort {
            mapping.effort = columns(text);
        }
        if let Some(text) = &self.time {
            mapping.time = (text != "none").then(|| text.clone());
        }
        if !self.joints.is_empty() {
            mapping.joints.clone_from(&self.joints);
        }
        if let Some(unit) = &self.position_unit {
            mapping.position_unit = PositionUnit::parse(unit)?;
        }
        if let Some(unit) = &self.velocity_unit {
            mapping.velocity_unit = VelocityUnit::parse(unit)?;
        }
        if let Some(unit) = &self.effort_unit {
            mapping.effort_unit = Some(EffortUnit::parse(unit)?);
        }
        if let Some(unit) = &self.time_unit {
            mapping.time_unit = TimeUnit::parse(unit)?;
        }
        if !self.gain.is_empty() {
            mapping.gain.clone_from(&self.gain);
        }
        mapping.run = self.run.clone().or(mapping.run);
        mapping.context = self.context_column.clone().or(mapping.context);
        if self.context.is_some() {
            mapping.context = None;
        }
        Ok(mapping)
    }
}

/// The logs, with the files of those that are folders of a bag, in the order of their names.
fn files_of(logs: &[PathBuf]) -> Result<Vec<PathBuf>, CliError> {
    let mut files = Vec::new();
    for log in logs {
        if !log.is_dir() {
            files.push(log.clone());
            continue;
        }
        let folder = log.display().to_string();
        let entries = std::fs::read_dir(log).map_err(CliError::io("read", folder.clone()))?;
        let mut parts: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        parts.retain(|path| path.extension().is_some_and(|extension| extension == "db3"));
        if parts.is_empty() {
            return Err(CliError::Usage(format!(
                "{folder}: a folder without a .db3 file; `ros2 bag convert` makes them of other bags"
            )));
        }
        parts.sort();
        files.extend(parts);
    }
    Ok(files)
}

/// The samples as they are written.
struct SamplesFile {
    has_context: bool,
    joints: Vec<String>,
    output: csv::Writer<Output>,
}

impl SamplesFile {
    /// Writes the header, or finds the joints to be those of the logs before.
    fn take_joints(&mut self, log: &dyn Recording) -> Result<(), CliError> {
        if self.joints.is_empty() {
            self.joints = log.joints().to_vec();
            let mut header: Vec<String> = Vec::new();
            header.extend(self.has_context.then(|| "context".to_owned()));
            header.extend(["run".to_owned(), "t".to_owned()]);
            // Numbers count from one, whatever the log counts from.
            let is_numbered = self.joints.iter().all(|joint| joint.parse::<u32>().is_ok());
            let naming = if is_numbered {
                Naming::Numbered
            } else {
                Naming::Named
            };
            for quantity in Quantity::ALL {
                header.extend(naming.columns(&prefix(quantity, naming), &self.joints));
            }
            return self.record(&header);
        }
        if self.joints == log.joints() {
            return Ok(());
        }
        Err(CliError::Usage(format!(
            "{}: its joints are {}, those of the logs before are {}",
            log.file(),
            log.joints().join(", "),
            self.joints.join(", ")
        )))
    }

    fn push(&mut self, run: &mut PreparedRun) -> Result<(), CliError> {
        let mut fields: Vec<String> = Vec::new();
        let (has_context, t) = (self.has_context, &run.t);
        let (name, context) = (&run.name, &run.context);
        run.columns.for_each_row(|row, values| {
            fields.clear();
            fields.extend(has_context.then(|| context.clone()));
            fields.extend([name.clone(), rounded(t[row])]);
            fields.extend(values.iter().map(|value| rounded(*value)));
            self.record(&fields)
        })
    }

    fn record(&mut self, fields: &[String]) -> Result<(), CliError> {
        let name = self.output.get_ref().name().to_owned();
        self.output
            .write_record(fields)
            .map_err(|error| CliError::Io {
                action: "write",
                file: name,
                source: error.into(),
            })
    }
}

/// What a quantity's columns begin with; states of friction and marks have `_` before a number, too.
fn prefix(quantity: Quantity, naming: Naming) -> String {
    let text = match quantity {
        Quantity::Position => return "q".to_owned(),
        Quantity::Velocity => return "qd".to_owned(),
        Quantity::Acceleration => return "qdd".to_owned(),
        Quantity::Torque => return "tau".to_owned(),
        Quantity::Used => "use".to_owned(),
        Quantity::Hysteresis(number) => format!("z{}", 1e3 * HYSTERESIS_LENGTHS[number]),
    };
    match naming {
        Naming::Numbered => format!("{text}_"),
        Naming::Named => text,
    }
}

/// A number of ten significant digits, as short as it can be written.
fn rounded(value: f64) -> String {
    let text = format!("{value:.*e}", DIGITS - 1);
    text.parse::<f64>().map_or(text, |value| value.to_string())
}

fn write(output: &mut Output, bytes: &[u8]) -> Result<(), CliError> {
    let name = output.name().to_owned();
    output.write_all(bytes).map_err(CliError::io("write", name))
}

fn report(file: &str, tally: &Tally, rate: Option<(f64, usize)>, settings: &Settings) {
    let (rate, every) = rate.unwrap_or((f64::NAN, 1));
    messages::note(format!(
        "{file}: {} rows at {rate:.6} Hz, low-pass of {} Hz, {} rows written (every {every})",
        tally.n_read, settings.cut_off, tally.n_written
    ));
    if let Some(first) = tally.first_garbage {
        messages::warning(format!(
            "{file}: {} rows with a number that is not finite or beyond {} in SI units are left out, the first is row {first}",
            tally.n_garbage,
            robot_log::ABSURD
        ));
    }
    if tally.n_duplicates > 0 {
        messages::warning(format!(
            "{file}: {} rows of a moment that was there before are left out",
            tally.n_duplicates
        ));
    }
    if tally.n_gaps > 0 {
        messages::warning(format!(
            "{file}: runs are cut at {} gaps in time",
            tally.n_gaps
        ));
    }
    if tally.n_short > 0 {
        messages::warning(format!(
            "{file}: {} stretches are too short for the filter",
            tally.n_short
        ));
    }
}
