//! `torque-gp simulate`: states and torques of the PUMA 560 along the scenario's paths.

use std::path::{Path, PathBuf};

use clap::ArgGroup;
use puma_dyn::Scenario;

use crate::commands::simulate::run::Run;
use crate::error::CliError;
use crate::format::Format;
use crate::messages;
use crate::output::{self, Output};
#[cfg(feature = "parquet")]
use crate::parquet_file;

/// The PUMA 560 carrying a load along a figure-of-eight path: time, states and torques
///
/// Without --scenario: paths p1..p4, speeds s1..s4 (20, 15, 10, 5 s per round), loads c1..c15 (0.2 to 3.0 kg),
/// 4000 samples each. Torques are free of noise.
///
/// Columns: context (the load), run (path and speed), t (s), q1..q6 (rad), qd1..qd6 (rad/s), qdd1..qdd6 (rad/s²),
/// tau1..tau6 (N·m).
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES, group = ArgGroup::new("target").required(true).args(["output", "all"]))]
pub struct Args {
    /// Paths, speeds and loads [default: the built-in reference scenario, fixtures/scenario.toml]
    #[arg(long, value_name = "FILE.toml")]
    scenario: Option<PathBuf>,

    /// Load, such as c3
    #[arg(long, value_name = "NAME", required_unless_present = "all")]
    load: Option<String>,

    /// Path, such as p2
    #[arg(long, value_name = "NAME", required_unless_present = "all")]
    path: Option<String>,

    /// Speed, such as s4
    #[arg(long, value_name = "NAME", required_unless_present = "all")]
    speed: Option<String>,

    /// Result, .csv or .parquet; `-` is standard output
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Every load, path and speed, one file each, into this directory (about 460 MB of CSV in 240 files)
    #[arg(long, value_name = "DIR", conflicts_with_all = ["load", "path", "speed"])]
    all: Option<PathBuf>,

    /// Format of the result [default: by the extension of --output; csv for --all]
    #[arg(long, value_enum)]
    format: Option<Format>,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp simulate --load c3 --path p2 --speed s4 --output data.csv
  torque-gp simulate --scenario mine.toml --load c3 --path p2 --speed s4 --output data.parquet
  torque-gp simulate --all data/

Exit status: 0, or 2 for bad input or usage; then there is one message and no broken file.";

/// Simulates one run or all of them.
///
/// # Errors
/// Anything wrong with the options, the scenario or the output.
pub fn run(args: &Args) -> Result<(), CliError> {
    let scenario = load(args.scenario.as_deref())?;
    match (&args.all, &args.output) {
        (Some(folder), _) => simulate_all(args, &scenario, folder),
        (None, Some(output)) => simulate_one(args, &scenario, output),
        (None, None) => Err(CliError::Usage(
            "either --output or --all is needed".to_owned(),
        )),
    }
}

fn load(path: Option<&Path>) -> Result<Scenario, CliError> {
    let Some(path) = path else {
        return Ok(Scenario::reference());
    };
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(CliError::io("read", file.clone()))?;
    Scenario::from_toml(&text).map_err(|cause| CliError::Scenario {
        file,
        cause: Box::new(cause),
    })
}

fn simulate_one(args: &Args, scenario: &Scenario, path: &Path) -> Result<(), CliError> {
    let inputs: Vec<&Path> = args.scenario.as_deref().into_iter().collect();
    output::check_not_an_input(path, &inputs)?;
    let format = Format::of(path, args.format)?;
    let load_idx = scenario.load_idx(args.load.as_deref().unwrap_or_default())?;
    let path_idx = scenario.path_idx(args.path.as_deref().unwrap_or_default())?;
    let speed_idx = scenario.speed_idx(args.speed.as_deref().unwrap_or_default())?;

    let output = Output::create(path)?;
    warn_of_ranges(scenario, Some(path_idx))?;
    let trajectory = scenario.trajectory(path_idx, speed_idx)?;
    let torques = scenario.torques(&trajectory, load_idx);
    let run = Run {
        context: &scenario.load_names()[load_idx],
        trajectory: &trajectory,
        torques: &torques,
    };
    let (name, n_samples) = (output.name().to_owned(), trajectory.n_samples());
    write(&run, output, format)?;
    messages::note(format!("{n_samples} rows written to {name}"));
    Ok(())
}

fn simulate_all(args: &Args, scenario: &Scenario, folder: &Path) -> Result<(), CliError> {
    if !folder.is_dir() {
        return Err(CliError::Usage(format!(
            "--all {}: the directory does not exist",
            folder.display()
        )));
    }
    let format = args.format.unwrap_or(Format::Csv).check_built()?;
    warn_of_ranges(scenario, None)?;
    let trajectories = scenario.trajectories()?;
    let contexts = scenario.load_names();
    for trajectory in &trajectories {
        for (load_idx, context) in contexts.iter().enumerate() {
            let torques = scenario.torques(trajectory, load_idx);
            let run = Run {
                context,
                trajectory,
                torques: &torques,
            };
            let file = format!("{context}_{}.{}", run.name(), format.extension());
            write(&run, Output::create(&folder.join(file))?, format)?;
        }
    }
    let n_files = trajectories.len() * contexts.len();
    messages::note(format!("{n_files} files written to {}", folder.display()));
    Ok(())
}

/// Writes a run in a format.
fn write(run: &Run<'_>, output: Output, format: Format) -> Result<(), CliError> {
    match format {
        Format::Csv => run.write_csv(output),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet_file::write(run, output),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => format.check_built().map(drop),
    }
}

/// Says which joints leave their mechanical ranges, on one path or on all.
fn warn_of_ranges(scenario: &Scenario, path_idx: Option<usize>) -> Result<(), CliError> {
    let excesses = scenario.range_excesses()?;
    let of_interest = excesses
        .iter()
        .filter(|excess| path_idx.is_none_or(|idx| excess.path_idx == idx));
    of_interest.for_each(messages::warning);
    Ok(())
}
