//! `bench-suite`: runs the experiments and prints what they say beside the chapter.

mod flags;
mod terminal;

use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;
use bench_suite::BenchError;
use bench_suite::adopt::{self, adopt};
use bench_suite::catalogue::Catalogue;
use bench_suite::regression::{self, Scores};
use bench_suite::report::durations;
use bench_suite::report::finding::Findings;
use bench_suite::reproduce::{ManyContexts, OneContext, Reproduction, Request, compute, reproduce};
use bench_suite::run::{Reuse, RunOutcome};
use bench_suite::section_experiment::{Kind, SectionExperiment};
use bench_suite::shard::Shard;
use bench_suite::spec::{Profile, Selection};
use bench_suite::store::{Work, write_atomically};
use clap::Parser;

use crate::flags::{Adopt, Command, Flags, NmseRegression, ReproducePaper, root};
use crate::terminal::Output;

/// Exit status when the request is at fault.
const BAD_REQUEST: u8 = 2;

fn main() -> ExitCode {
    let result = match Flags::parse().command {
        Command::ReproducePaper(flags) => reproduce_paper(flags),
        Command::NmseRegression(flags) => nmse_regression(&flags),
        Command::Adopt(flags) => take_over(flags),
        Command::List => list(),
    };
    result.unwrap_or_else(|error| complain(&error))
}

fn complain(error: &anyhow::Error) -> ExitCode {
    let known = error.downcast_ref::<BenchError>();
    // Its own messages say everything; `{:#}` would say the cause once more.
    let message = known.map_or_else(|| format!("{error:#}"), ToString::to_string);
    terminal::error(message);
    match known {
        Some(
            BenchError::UnknownName { .. }
            | BenchError::Experiment { .. }
            | BenchError::UnusedFlag { .. },
        ) => ExitCode::from(BAD_REQUEST),
        _ => ExitCode::FAILURE,
    }
}

fn reproduce_paper(flags: ReproducePaper) -> anyhow::Result<ExitCode> {
    let shard = flags.shard;
    let request = Request {
        profile: flags.profile,
        only: flags.only,
        output: flags.output,
        selection: Selection {
            joints: flags.joints,
            loads: flags.loads,
            sizes: flags.sizes,
            totals: flags.totals,
            ranks: flags.ranks,
            n_more_repeats: flags.repeats - 1,
        },
        shard: shard.unwrap_or(Shard::WHOLE),
        n_threads: flags.threads,
        reuse: flags.reuse,
        seed: flags.seed,
        command: typed_command(),
    };
    if let Some(shard) = shard {
        return compute_share(&request, shard);
    }
    let reproduction = reproduce(&request)?;
    print(&mut Output::new(), &reproduction)?;
    Ok(status(reproduction.is_complete()))
}

fn compute_share(request: &Request, shard: Shard) -> anyhow::Result<ExitCode> {
    let share = compute(request)?;
    let mut out = Output::new();
    for line in share.counts().iter().chain(&share.failed()) {
        writeln!(out, "shard {shard}: {line}")?;
    }
    Ok(status(share.is_complete()))
}

fn status(is_good: bool) -> ExitCode {
    if is_good {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

fn print(out: &mut Output, reproduction: &Reproduction) -> io::Result<()> {
    print_findings(out, &reproduction.about_data)?;
    if let Some(one) = &reproduction.one {
        print_one(out, one)?;
    }
    if let Some(many) = &reproduction.many {
        print_many(out, many)?;
    }
    print_findings(out, &reproduction.section5)?;
    if let Some(work) = &reproduction.section5_work {
        print_missing(out, &work.missing)?;
        for failed in &work.failed {
            writeln!(out, "Without a result: {failed}")?;
        }
    }
    let directory = reproduction.directory.display();
    writeln!(
        out,
        "Report: {directory}/report.html, as Markdown report.md; figures and CSV files beside it"
    )
}

fn print_one(out: &mut Output, one: &OneContext) -> io::Result<()> {
    if let Some(table) = &one.table3 {
        writeln!(
            out,
            "\nTable 3, average nMSE over the loads; ratio = ours / published\n"
        )?;
        writeln!(out, "{}", table.to_text())?;
    }
    print_findings(out, &one.findings)?;
    print_seconds(
        out,
        durations::OF_CELLS,
        &durations::of_cells(&one.outcome.records).to_text(),
        &one.outcome,
    )
}

fn print_many(out: &mut Output, many: &ManyContexts) -> io::Result<()> {
    writeln!(
        out,
        "\nRanks chosen by BIC and models that the mGPs start from (in parentheses: the chapter's)\n"
    )?;
    writeln!(out, "{}", many.table.to_text())?;
    print_findings(out, &many.findings)?;
    print_seconds(
        out,
        durations::OF_UNITS,
        &durations::of_units(&many.outcome.records).to_text(),
        &many.outcome,
    )
}

fn print_findings(out: &mut Output, findings: &Findings) -> io::Result<()> {
    for (title, found) in findings {
        writeln!(out, "{title}:")?;
        for finding in found {
            writeln!(out, "  {finding}")?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn print_missing(out: &mut Output, missing: &[impl Display]) -> io::Result<()> {
    let Some(first) = missing.first() else {
        return Ok(());
    };
    let n = missing.len();
    writeln!(out, "Not computed yet: {n}, the first of them {first}.\n")
}

fn print_seconds<W: Work>(
    out: &mut Output,
    title: &str,
    table: &str,
    outcome: &RunOutcome<W>,
) -> io::Result<()> {
    print_missing(out, &outcome.missing)?;
    writeln!(out, "{title}:\n{table}")?;
    let seconds = &outcome.seconds;
    writeln!(
        out,
        "This run: data set {:.1} s, computing {:.1} s.",
        seconds.data_set, seconds.cells
    )
}

fn nmse_regression(flags: &NmseRegression) -> anyhow::Result<ExitCode> {
    let reproduction = reproduce(&Request {
        profile: Profile::Smoke,
        only: Catalogue::scored_names()?,
        output: flags.output.clone(),
        selection: Selection::default(),
        shard: Shard::WHOLE,
        n_threads: flags.threads,
        reuse: Reuse::Fits,
        seed: None,
        command: typed_command(),
    })?;
    let path = root().join("fixtures/bench-suite/expected_nmse.csv");
    if flags.update {
        return update(&path, &reproduction);
    }
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let expected = Scores::read(&path.display().to_string(), &text)?;
    let moved = regression::moved(&scores(&reproduction), &expected);
    let mut out = Output::new();
    for line in &moved {
        writeln!(out, "{line}")?;
    }
    writeln!(
        out,
        "{} of {} averages moved",
        moved.len(),
        expected.0.len()
    )?;
    Ok(status(moved.is_empty()))
}

/// Averages of the smoke profile, of one context and of many.
fn scores(reproduction: &Reproduction) -> Scores {
    let mut scores = Scores::default();
    if let Some(one) = &reproduction.one {
        scores.add_averages(&one.averages);
    }
    if let Some(many) = &reproduction.many {
        scores.add_curves(&many.curves);
    }
    scores
}

fn update(path: &Path, reproduction: &Reproduction) -> anyhow::Result<ExitCode> {
    anyhow::ensure!(
        reproduction.is_complete(),
        "cells failed; the committed file stays"
    );
    write_atomically(path, scores(reproduction).to_csv().as_bytes())?;
    writeln!(Output::new(), "{} renewed", path.display())?;
    Ok(ExitCode::SUCCESS)
}

fn take_over(flags: Adopt) -> anyhow::Result<ExitCode> {
    let adoption = adopt(&adopt::Request {
        from: flags.from,
        output: flags.output,
        n_witnesses: flags.witnesses,
        n_threads: flags.threads,
        experiments: SectionExperiment::all(Kind::Section5)?,
    })?;
    let mut out = Output::new();
    for file in &adoption.unread {
        writeln!(out, "left: {file}")?;
    }
    let n_witnesses = adoption.n_witnesses;
    if !adoption.differences.is_empty() {
        for line in &adoption.differences {
            writeln!(out, "differs: {line}")?;
        }
        writeln!(
            out,
            "Nothing is adopted: {n_witnesses} witnesses, and what is above is not the same."
        )?;
        return Ok(ExitCode::from(BAD_REQUEST));
    }
    writeln!(
        out,
        "{} results adopted, since {n_witnesses} of them computed again are the same to the bit; {} were there already, {} files left.",
        adoption.n_adopted,
        adoption.n_there,
        adoption.unread.len()
    )?;
    Ok(ExitCode::SUCCESS)
}

fn list() -> anyhow::Result<ExitCode> {
    let catalogue = Catalogue::all()?;
    let mut out = Output::new();
    for experiment in &catalogue.data {
        writeln!(out, "{:8} {}", experiment.name, experiment.title)?;
    }
    for experiment in &catalogue.one {
        writeln!(out, "{:8} {}", experiment.name, experiment.title)?;
        for (profile, scope) in &experiment.profile {
            let (loads, n_cells) = (scope.loads.len(), experiment.cells(scope).len());
            let (joints, sizes) = (&scope.joints, &scope.sizes);
            writeln!(
                out,
                "         {:6} {n_cells} cells: {loads} loads, joints {joints:?}, n {sizes:?}",
                profile.name()
            )?;
        }
    }
    for experiment in &catalogue.many {
        writeln!(out, "{:8} {}", experiment.name, experiment.title)?;
        for (profile, scope) in &experiment.profile {
            let (contexts, n_units) = (experiment.n_contexts, experiment.units(scope, 1).len());
            let (joints, totals) = (&scope.joints, &scope.totals);
            writeln!(
                out,
                "         {:6} {n_units} units: {contexts} contexts, joints {joints:?}, n {totals:?}, ranks {:?}",
                profile.name(),
                scope.ranks
            )?;
        }
    }
    for experiment in &catalogue.section5 {
        writeln!(out, "{:8} {}", experiment.name, experiment.title)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The command as a reader of the report would type it.
fn typed_command() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    format!("cargo xtask {}", arguments.join(" "))
}
