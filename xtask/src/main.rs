//! `cargo xtask <command>`: starts the project's programs and checks its text.

mod arrows;
mod bits;
mod equations;
mod flags;
mod kill_test;
mod licences;
mod paths;
mod program;
mod rust_text;
mod tidy;

use std::process::ExitCode;

use clap::Parser;

use crate::flags::{Command, Flags};

fn main() -> ExitCode {
    run(Flags::parse().command).unwrap_or_else(|error| complain(&error))
}

fn run(command: Command) -> anyhow::Result<ExitCode> {
    match command {
        Command::ReproducePaper { arguments } => {
            program::bench_suite("reproduce-paper", &arguments)
        }
        Command::NmseRegression { arguments } => {
            program::bench_suite("nmse-regression", &arguments)
        }
        Command::KillTest { kills, arguments } => kill_test::run(kills, &arguments),
        Command::Bits { write, check, only } => match (write, check) {
            (Some(directory), _) => bits::write(&directory, &only),
            (None, directory) => bits::check(&directory.unwrap_or_default(), &only),
        },
        Command::Tidy => tidy::run(),
        Command::Equations { check } => equations::run(check),
    }
}

#[expect(clippy::print_stderr, reason = "the one place where an error is shown")]
fn complain(error: &anyhow::Error) -> ExitCode {
    eprintln!("error: {error:#}");
    ExitCode::FAILURE
}
