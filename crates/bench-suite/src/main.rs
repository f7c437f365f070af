//! `bench-suite`: runs the experiments and prints what they say beside the chapter.
#![expect(
    clippy::print_stdout,
    reason = "the table on standard output is what the command is for"
)]

mod flags;

use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;
use bench_suite::BenchError;
use bench_suite::catalogue::Catalogue;
use bench_suite::regression;
use bench_suite::report::{averages, durations};
use bench_suite::reproduce::{Reproduction, Request, reproduce};
use bench_suite::run::Reuse;
use bench_suite::spec::{Profile, Selection};
use bench_suite::store::write_atomically;
use clap::Parser;

use crate::flags::{Command, Flags, NmseRegression, ReproducePaper, root};

/// Exit status when the request is at fault.
const BAD_REQUEST: u8 = 2;

fn main() -> ExitCode {
    let result = match Flags::parse().command {
        Command::ReproducePaper(flags) => reproduce_paper(flags),
        Command::NmseRegression(flags) => nmse_regression(&flags),
        Command::List => list(),
    };
    result.unwrap_or_else(|error| complain(&error))
}

#[expect(clippy::print_stderr, reason = "the one place where an error is shown")]
fn complain(error: &anyhow::Error) -> ExitCode {
    eprintln!("error: {error:#}");
    match error.downcast_ref() {
        Some(BenchError::UnknownName { .. }) => ExitCode::from(BAD_REQUEST),
        _ => ExitCode::FAILURE,
    }
}

fn reproduce_paper(flags: ReproducePaper) -> anyhow::Result<ExitCode> {
    let reproduction = reproduce(&Request {
        profile: flags.profile,
        only: flags.only,
        output: flags.output,
        selection: Selection {
            loads: flags.loads,
            joints: flags.joints,
            sizes: flags.sizes,
        },
        n_threads: flags.threads,
        reuse: flags.reuse,
        command: typed_command(),
    })?;
    print(&reproduction);
    Ok(status(reproduction.outcome.failures.is_empty()))
}

fn status(is_good: bool) -> ExitCode {
    if is_good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn print(reproduction: &Reproduction) {
    if let Some(table) = &reproduction.table3 {
        println!("\nTable 3, average nMSE over the loads; ratio = ours / published\n");
        println!("{}", table.to_text());
    }
    for (title, found) in &reproduction.findings {
        println!("{title}:");
        for finding in found {
            println!("  {finding}");
        }
        println!();
    }
    if reproduction.outcome.n_missing > 0 {
        println!(
            "{} cells are not computed yet.",
            reproduction.outcome.n_missing
        );
    }
    if !reproduction.outcome.records.is_empty() {
        println!(
            "{}:\n{}",
            durations::TITLE,
            durations::by_model_and_size(&reproduction.outcome.records).to_text()
        );
    }
    let seconds = &reproduction.outcome.seconds;
    println!(
        "This run: data set {:.1} s, cells {:.1} s.",
        seconds.data_set, seconds.cells
    );
    let directory = reproduction.directory.display();
    println!("Report, figure and CSV files: {directory}/report.md");
}

fn nmse_regression(flags: &NmseRegression) -> anyhow::Result<ExitCode> {
    let reproduction = reproduce(&Request {
        profile: Profile::Smoke,
        only: Vec::new(),
        output: flags.output.clone(),
        selection: Selection::default(),
        n_threads: flags.threads,
        reuse: Reuse::Fits,
        command: typed_command(),
    })?;
    let path = root().join("fixtures/bench-suite/expected_nmse.csv");
    if flags.update {
        return update(&path, &reproduction);
    }
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let expected = averages::read_table(&path.display().to_string(), &text)?;
    let moved = regression::moved(&reproduction.averages, &expected);
    for line in &moved {
        println!("{line}");
    }
    println!("{} of {} averages moved", moved.len(), expected.len());
    Ok(status(moved.is_empty()))
}

fn update(path: &Path, reproduction: &Reproduction) -> anyhow::Result<ExitCode> {
    let outcome = &reproduction.outcome;
    anyhow::ensure!(
        outcome.failures.is_empty(),
        "cells failed; the committed file stays"
    );
    write_atomically(
        path,
        averages::write_table(&reproduction.averages).as_bytes(),
    )?;
    println!("{} renewed", path.display());
    Ok(ExitCode::SUCCESS)
}

fn list() -> anyhow::Result<ExitCode> {
    let all = Catalogue::all()?;
    for experiment in &all.data {
        println!("{:8} {}", experiment.name, experiment.title);
    }
    for experiment in &all.one {
        println!("{:8} {}", experiment.name, experiment.title);
        for (profile, scope) in &experiment.profile {
            let (loads, n_cells) = (scope.loads.len(), experiment.cells(scope).len());
            let (joints, sizes) = (&scope.joints, &scope.sizes);
            println!(
                "         {:6} {n_cells} cells: {loads} loads, joints {joints:?}, n {sizes:?}",
                profile.name()
            );
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The command as a reader of the report would type it.
fn typed_command() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    format!("cargo xtask {}", arguments.join(" "))
}
