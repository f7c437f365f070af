//! The command line of `cargo xtask`.

use clap::{Parser, Subcommand};

/// The project's own commands.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
pub struct Flags {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// Commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Compute the chapter's tables and figures and compare them with the published ones
    #[command(disable_help_flag = true)]
    ReproducePaper {
        /// Passed on to `bench-suite reproduce-paper`
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Compare the averages of the smoke profile with the committed ones
    #[command(disable_help_flag = true)]
    NmseRegression {
        /// Passed on to `bench-suite nmse-regression`
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<String>,
    },
    /// Kill a run of reproduce-paper at many moments and compare its files with those of an undisturbed one
    KillTest {
        /// Number of kills
        #[arg(long, default_value_t = 20, value_name = "N")]
        kills: usize,
        /// Passed on to `bench-suite reproduce-paper`, after `--`
        #[arg(last = true)]
        arguments: Vec<String>,
    },
    /// Check the text of the repository
    Tidy,
    /// Build docs/EQUATIONS.md from the sources
    Equations {
        /// Only say whether the file is up to date
        #[arg(long)]
        check: bool,
    },
}
