//! The command line of `cargo xtask`.

use std::path::PathBuf;

use clap::{Parser, Subcommand};

use crate::bits::Group;

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
    /// Record results of both programs as hashes, or check that they are the same bits as before
    ///
    /// A lock for changes that must not move any number: write the list before such a change and check it after each
    /// step, on the same machine. It runs the release builds of `torque-gp` and `bench-suite` on fixed inputs and
    /// looks at their files and what they print alone. DIR/bits.tsv has a line a result, its SHA-256 and its
    /// name, and DIR the results themselves; those that a check finds changed are put in
    /// target/release/bits-changed.
    #[command(group = clap::ArgGroup::new("what").required(true))]
    Bits {
        /// Compute everything and write the list to DIR
        #[arg(long, value_name = "DIR", group = "what")]
        write: Option<PathBuf>,
        /// Compute everything again and name what differs, is new or is gone; exit status 1 if anything does
        #[arg(long, value_name = "DIR", group = "what")]
        check: Option<PathBuf>,
        /// Only these groups; those that are not asked for stay in DIR as they are
        #[arg(long, value_name = "GROUP,…", value_delimiter = ',')]
        only: Vec<Group>,
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
