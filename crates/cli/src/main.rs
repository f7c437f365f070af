//! `torque-gp`: inverse dynamics of robot arms from the command line.
//!
//! Every command either succeeds, or says in one message what is wrong and where, leaves no output file and
//! exits with status 2. Warnings and notes go to standard error, results to files or standard output.

mod columns;
mod commands;
mod degrees;
mod error;
mod format;
mod messages;
mod output;
#[cfg(feature = "parquet")]
mod parquet_file;
mod payload_file;
mod robot;
mod table;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::commands::{inverse_dynamics, simulate};
use crate::error::CliError;

/// Exit status for bad input or usage, the same as clap's own.
const BAD_INPUT: u8 = 2;

/// Inverse dynamics of robot arms: torques from positions, speeds and accelerations.
///
/// SI units everywhere: rad, rad/s, rad/s², N·m, kg, m (m, m/s, m/s², N for sliding joints).
#[derive(Parser)]
#[command(name = "torque-gp", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    InverseDynamics(inverse_dynamics::Args),
    Simulate(simulate::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::InverseDynamics(args) => inverse_dynamics::run(&args),
        Command::Simulate(args) => simulate::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // The reader of a pipe has seen enough.
        Err(CliError::Io { source, .. }) if source.kind() == std::io::ErrorKind::BrokenPipe => {
            ExitCode::SUCCESS
        }
        Err(error) => {
            messages::error(&error);
            ExitCode::from(BAD_INPUT)
        }
    }
}
