//! `torque-gp`: inverse dynamics of robot arms, computed and learned, from the command line.
//!
//! Every command either succeeds, or says in one message what is wrong and where, leaves no output file and
//! exits with status 2. Warnings and notes go to standard error, results to files or standard output.

#![allow(
    rustdoc::invalid_html_tags,
    reason = "doc comments of arguments are the text of --help, where <joint> stands for a name"
)]

mod body_table;
mod columns;
mod commands;
mod context;
mod context_column;
mod context_hyperparameters;
mod context_prior;
mod continuous;
mod data_args;
mod degrees;
mod error;
mod few_states;
mod format;
mod header_joints;
mod hyperparameter_file;
mod joints;
mod log_columns;
mod log_rows;
#[cfg(test)]
mod malformed;
mod memory_rows;
mod messages;
mod method;
mod model_file;
mod noise_std;
mod number_column;
mod numbered_names;
mod output;
#[cfg(feature = "parquet")]
mod parquet_file;
mod payload_file;
mod payload_folder;
mod printed;
mod range_watch;
mod result_table;
mod robot;
mod row_contexts;
mod row_spacing;
mod run_clock;
mod samples;
mod score;
mod table;
mod text_table;
mod toml_fault;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::commands::{
    adapt, context as context_command, control, evaluate, export, fit, inspect, inverse_dynamics,
    likelihood, predict, prepare, sample, simulate,
};
use crate::error::CliError;

/// Exit status for bad input or usage, the same as clap's own.
const BAD_INPUT: u8 = 2;

/// Inverse dynamics of robot arms: torques from positions, speeds and accelerations, by physics or learned from data.
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
    Prepare(prepare::Args),
    Fit(fit::Args),
    Predict(predict::Args),
    Evaluate(evaluate::Args),
    Context(context_command::Args),
    Adapt(adapt::Args),
    Inspect(inspect::Args),
    Export(export::Args),
    Likelihood(likelihood::Args),
    Control(control::Args),
    Sample(sample::Args),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::InverseDynamics(args) => inverse_dynamics::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Prepare(args) => prepare::run(&args),
        Command::Fit(args) => fit::run(&args),
        Command::Predict(args) => predict::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
        Command::Context(args) => context_command::run(&args),
        Command::Adapt(args) => adapt::run(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Likelihood(args) => likelihood::run(&args),
        Command::Control(args) => control::run(&args),
        Command::Sample(args) => sample::run(&args),
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
