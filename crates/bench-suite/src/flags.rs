//! The command line of `bench-suite`.

use std::path::{Path, PathBuf};

use bench_suite::dataset::N_JOINTS;
use bench_suite::run::Reuse;
use bench_suite::shard::Shard;
use bench_suite::spec::{MAX_SIZE, Profile};
use bench_suite::split::UNIQUE;
use clap::{Args, Parser, Subcommand};

/// Largest number of threads.
const MAX_THREADS: usize = 1024;

/// Experiments of the chapter, sections 3.4 and 4.6.
#[derive(Debug, Parser)]
#[command(name = "bench-suite", version)]
pub struct Flags {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compute the tables and figures and compare them with the published ones
    ReproducePaper(ReproducePaper),
    /// Compare the averages of the smoke profile with the committed ones
    NmseRegression(NmseRegression),
    /// Take over the results of an earlier revision, if today's program computes samples of them to the bit
    Adopt(Adopt),
    /// Name the experiments and the profiles
    List,
}

/// Flags of `reproduce-paper`.
#[derive(Debug, Args)]
pub struct ReproducePaper {
    /// Amount of work: minutes, or everything that the chapter reports
    #[arg(long, value_enum, default_value_t = Profile::Smoke)]
    pub profile: Profile,
    /// Only these experiments, separated by commas (see `list`)
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    pub only: Vec<String>,
    /// What to take from earlier runs
    #[arg(long = "from", value_enum, default_value_t = Reuse::Fits)]
    pub reuse: Reuse,
    /// Only part I of N of the fits, and no report: for one of N machines with one `--output`
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Directory of finished cells and reports
    #[arg(long, value_name = "DIR", default_value_os_t = default_output())]
    pub output: PathBuf,
    /// These joints instead of the profile's, from 1
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = number_up_to::<N_JOINTS>)]
    pub joints: Option<Vec<usize>>,
    /// These loads instead of all, with one context: c1 or 1, …
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = load)]
    pub loads: Option<Vec<usize>>,
    /// These training-set sizes instead of the profile's, with one context
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = number_up_to::<MAX_SIZE>)]
    pub sizes: Option<Vec<usize>>,
    /// These sizes of all 14 contexts together instead of the profile's, in figures 10 and 11
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = number_up_to::<{ 14 * MAX_SIZE }>)]
    pub totals: Option<Vec<usize>>,
    /// These ranks of the mGPs instead of the profile's, in figures 10 and 11
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = number_up_to::<14>)]
    pub ranks: Option<Vec<usize>>,
    /// Draws of the training subsets of figures 10 and 11, which then show a band
    #[arg(long, default_value_t = 1, value_name = "K", value_parser = number_up_to::<100>)]
    pub repeats: usize,
    /// Other random draws of all training samples than the committed ones
    #[arg(long, value_name = "TEXT", value_parser = seed)]
    pub seed: Option<String>,
    /// Threads; 0 is one a core
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub threads: usize,
}

/// Flags of `nmse-regression`.
#[derive(Debug, Args)]
pub struct NmseRegression {
    /// Write the present averages into the committed file instead of comparing
    #[arg(long)]
    pub update: bool,
    /// Directory of finished cells and reports
    #[arg(long, value_name = "DIR", default_value_os_t = default_output())]
    pub output: PathBuf,
    /// Threads; 0 is one a core
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub threads: usize,
}

/// Flags of `adopt`.
#[derive(Debug, Args)]
pub struct Adopt {
    /// Output directory of an earlier revision, or one directory of results in it
    #[arg(long, value_name = "OLD")]
    pub from: PathBuf,
    /// Directory of finished cells and reports; may be the same
    #[arg(long, value_name = "DIR", default_value_os_t = default_output())]
    pub output: PathBuf,
    /// Results of each kind of work, model and size that are computed again, the cheapest first
    #[arg(long, default_value_t = 2, value_name = "N", value_parser = number_up_to::<1000>)]
    pub witnesses: usize,
    /// Threads; 0 is one a core
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = threads)]
    pub threads: usize,
}

/// Root of the checkout that this program was compiled from.
pub fn root() -> &'static Path {
    let crate_dir = Path::new(env!("CARGO_MANIFEST_DIR"));
    crate_dir.ancestors().nth(2).unwrap_or(crate_dir)
}

fn default_output() -> PathBuf {
    root().join("results")
}

fn number_up_to<const MAX: usize>(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(i) if (1..=MAX).contains(&i) => Ok(i),
        _ => Err(format!("not a whole number from 1 to {MAX}")),
    }
}

/// A million threads would be refused by the system with less clear words.
fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(n) if n <= MAX_THREADS => Ok(n),
        _ => Err(format!("not a whole number from 0 to {MAX_THREADS}")),
    }
}

fn seed(text: &str) -> Result<String, String> {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if text.is_empty() || !text.chars().all(is_allowed) {
        return Err("not letters, digits, `-`, `_` and `.`".to_string());
    }
    Ok(text.to_string())
}

fn load(text: &str) -> Result<usize, String> {
    let number = text.strip_prefix('c').unwrap_or(text);
    number_up_to::<{ UNIQUE.len() }>(number)
        .map_err(|_| format!("not one of c1 to c{}", UNIQUE.len()))
}
