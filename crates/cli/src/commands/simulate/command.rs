//! `torque-gp simulate`: states and torques of the PUMA 560 along the scenario's paths.

use std::path::{Path, PathBuf};

use clap::ArgGroup;
use puma_dyn::chapter::Trajectory;
use puma_dyn::motion::TorqueNoise;
use puma_dyn::puma560::N_JOINTS;
use puma_dyn::{Scenario, Sidecar};

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
/// 4000 samples each. Torques are free of noise unless --noise says otherwise.
///
/// Columns: context (the load), run (path and speed), t (s), q1..q6 (rad), qd1..qd6 (rad/s), qdd1..qdd6 (rad/s²),
/// tau1..tau6 (N·m).
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES, group = ArgGroup::new("target").required(true).args(["output", "all"]))]
pub struct Args {
    /// Paths, speeds and loads [default: the built-in reference scenario, fixtures/scenario.toml]
    #[arg(long, value_name = "FILE.toml")]
    scenario: Option<PathBuf>,

    /// Drives and friction of the arm's joints (joint1..joint6) in place of the built-in ones, key by key
    #[arg(long, value_name = "FILE.toml")]
    sidecar: Option<PathBuf>,

    /// Add noise of this standard deviation to the torques, N·m: one for all joints, or one for each
    #[arg(
        long,
        value_name = "STD[,STD…]",
        value_delimiter = ',',
        allow_hyphen_values = true
    )]
    noise: Vec<f64>,

    /// Correlation time of the noise, s: its covariance falls as exp(−Δt/T); 0 is white
    #[arg(
        long,
        value_name = "SECONDS",
        default_value_t = 0.0,
        requires = "noise",
        allow_hyphen_values = true
    )]
    correlation: f64,

    /// Seed of the noise, which is also each run's and each load's own
    #[arg(long, value_name = "N", default_value_t = 0, requires = "noise")]
    seed: u64,

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
  torque-gp simulate --load c3 --path p2 --speed s4 --noise 0.2 --correlation 0.05 --seed 7 --output noisy.csv
  torque-gp simulate --sidecar friction.toml --load c3 --path p2 --speed s4 --output data.csv
  torque-gp simulate --all data/

Exit status: 0, or 2 for bad input or usage; then there is one message and no broken file.";

/// Simulates one run or all of them.
///
/// # Errors
/// Anything wrong with the options, the scenario or the output.
pub fn run(args: &Args) -> Result<(), CliError> {
    let mut scenario = load(args.scenario.as_deref())?;
    if let Some(sidecar) = &args.sidecar {
        scenario = scenario.with_sidecar(&Sidecar::load(sidecar)?)?;
    }
    let noise = noise(args)?;
    match (&args.all, &args.output) {
        (Some(folder), _) => simulate_all(args, &scenario, noise.as_ref(), folder),
        (None, Some(output)) => simulate_one(args, &scenario, noise.as_ref(), output),
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

/// The noise that was asked for.
fn noise(args: &Args) -> Result<Option<TorqueNoise>, CliError> {
    let std = match args.noise[..] {
        [] => return Ok(None),
        [std] => vec![std; N_JOINTS],
        ref each if each.len() == N_JOINTS => each.to_vec(),
        ref others => {
            let found = others.len();
            return Err(CliError::Usage(format!(
                "--noise has {found} standard deviations; one is needed, or {N_JOINTS}, one for each joint"
            )));
        }
    };
    Ok(Some(TorqueNoise::new(std, args.correlation)?))
}

/// Torques of a run as they are measured.
fn measured(
    scenario: &Scenario,
    noise: Option<(&TorqueNoise, u64)>,
    trajectory: &Trajectory,
    load_idx: usize,
) -> Vec<f64> {
    let mut torques = scenario.torques(trajectory, load_idx);
    if let Some((noise, seed)) = noise {
        let context = &scenario.load_names()[load_idx];
        let label = format!("{context}/{}/{}", trajectory.path, trajectory.speed);
        noise.add(seed, &label, &trajectory.time, &mut torques);
    }
    torques
}

fn simulate_one(
    args: &Args,
    scenario: &Scenario,
    noise: Option<&TorqueNoise>,
    path: &Path,
) -> Result<(), CliError> {
    let files = [args.scenario.as_deref(), args.sidecar.as_deref()];
    let inputs: Vec<&Path> = files.into_iter().flatten().collect();
    output::check_not_an_input(path, &inputs)?;
    let format = Format::of(path, args.format)?;
    let load_idx = scenario.load_idx(args.load.as_deref().unwrap_or_default())?;
    let path_idx = scenario.path_idx(args.path.as_deref().unwrap_or_default())?;
    let speed_idx = scenario.speed_idx(args.speed.as_deref().unwrap_or_default())?;

    let output = Output::create(path)?;
    warn_of_ranges(scenario, Some(path_idx))?;
    let trajectory = scenario.trajectory(path_idx, speed_idx)?;
    let noise = noise.map(|noise| (noise, args.seed));
    let torques = measured(scenario, noise, &trajectory, load_idx);
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

fn simulate_all(
    args: &Args,
    scenario: &Scenario,
    noise: Option<&TorqueNoise>,
    folder: &Path,
) -> Result<(), CliError> {
    if !folder.is_dir() {
        return Err(CliError::Usage(format!(
            "--all {}: the directory does not exist",
            folder.display()
        )));
    }
    let format = args.format.unwrap_or(Format::Csv).check_built()?;
    warn_of_ranges(scenario, None)?;
    let noise = noise.map(|noise| (noise, args.seed));
    let trajectories = scenario.trajectories()?;
    let contexts = scenario.load_names();
    for trajectory in &trajectories {
        for (load_idx, context) in contexts.iter().enumerate() {
            let torques = measured(scenario, noise, trajectory, load_idx);
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
