//! The options that say which measured rows a command takes.

use std::path::PathBuf;

/// Measured data and the part of it that counts.
#[derive(clap::Args, Debug)]
pub struct DataArgs {
    /// Measured states and torques; `-` is standard input
    #[arg(long = "data", value_name = "FILE.csv")]
    pub path: PathBuf,

    /// Rows to take, by their entry in the column `context`
    #[arg(long, value_name = "NAME")]
    pub context: Option<String>,

    /// Start of the torque columns' names
    #[arg(long, value_name = "NAME", default_value = "tau")]
    pub tau_prefix: String,
}
