//! A run that is killed again and again must end with the files of a run that is left alone.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, ensure};

use crate::program;

/// Fraction of the golden ratio: its multiples, without their whole parts, fill 0 to 1 evenly and in no order.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Kills a run `n_kills` times, has two runs at once finish it, and compares all CSV files with those of an undisturbed run.
///
/// A kill comes after up to an eighth of the time that the undisturbed run took, so that some of them hit
/// the fits and the last ones the writing of the report.
///
/// # Errors
/// If a program cannot be started, a run that is left alone fails, or the files differ.
#[expect(clippy::print_stdout, reason = "the result is what the command is for")]
pub fn run(n_kills: usize, arguments: &[String]) -> anyhow::Result<ExitCode> {
    program::build(&["bench-suite"])?;
    let directory = tempfile::tempdir()?;
    let (alone, killed) = (
        directory.path().join("alone"),
        directory.path().join("killed"),
    );

    let started = Instant::now();
    finish(&alone, arguments)?;
    let seconds = started.elapsed().as_secs_f64();
    println!("left alone: {seconds:.1} s");

    let mut n_killed = 0;
    for i in 1..=n_kills {
        let moment = (i as f64 * GOLDEN).fract() * seconds / 8.0;
        if kill_after(
            &mut start(&killed, arguments)?,
            Duration::from_secs_f64(moment),
        )? {
            n_killed += 1;
        }
        println!(
            "run {i}: {moment:.2} s, {} results kept",
            n_results(&killed)?
        );
    }
    let both = [start(&killed, arguments)?, start(&killed, arguments)?];
    both.into_iter().try_for_each(end)?;

    let expected = tables(&alone)?;
    ensure!(!expected.is_empty(), "the run left alone wrote no CSV file");
    let reports = tables(&killed)?;
    for ((report, name), contents) in &reports {
        let own = expected.iter().find(|((_, other), _)| other == name);
        let (_, own) = own.with_context(|| format!("{report}/{name} should not be there"))?;
        ensure!(
            own == contents,
            "{report}/{name} differs after {n_killed} kills"
        );
    }
    let n = expected.len();
    ensure!(
        reports.len() >= 2 * n,
        "the last two runs wrote less than the one left alone"
    );
    println!(
        "{n} CSV files are the same bytes after {n_killed} kills, in the reports of both runs that ended it"
    );
    Ok(ExitCode::SUCCESS)
}

fn start(output: &Path, arguments: &[String]) -> anyhow::Result<Child> {
    let mut command = Command::new(program::path("bench-suite")?);
    command.arg("reproduce-paper").args(arguments);
    command.arg("--output").arg(output);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().context("cannot start bench-suite")
}

fn finish(output: &Path, arguments: &[String]) -> anyhow::Result<()> {
    end(start(output, arguments)?)
}

fn end(mut run: Child) -> anyhow::Result<()> {
    let status = run.wait()?;
    ensure!(
        status.success(),
        "a run that nobody killed ended with {status}"
    );
    Ok(())
}

/// Kills a run after a time; whether it was still running.
fn kill_after(child: &mut Child, time: Duration) -> anyhow::Result<bool> {
    std::thread::sleep(time);
    let is_running = child.try_wait()?.is_none();
    child.kill()?;
    child.wait()?;
    Ok(is_running)
}

fn n_results(output: &Path) -> anyhow::Result<usize> {
    let is_result = |path: &&PathBuf| path.extension().is_some_and(|e| e == "toml");
    let is_manifest = |path: &&PathBuf| path.ends_with("manifest.toml");
    let all = files(output)?;
    Ok(all
        .iter()
        .filter(|path| is_result(path) && !is_manifest(path))
        .count())
}

/// The CSV files of all reports by the report's name and their own, without those of seconds.
fn tables(output: &Path) -> anyhow::Result<BTreeMap<(String, String), Vec<u8>>> {
    let mut tables = BTreeMap::new();
    for path in files(output)? {
        let text = |part: Option<&OsStr>| part.unwrap_or_default().to_string_lossy().into_owned();
        let name = text(path.file_name());
        let is_table = path.extension().is_some_and(|e| e == "csv");
        if is_table && !name.ends_with("seconds.csv") {
            let report = text(path.parent().and_then(Path::file_name));
            tables.insert((report, name), std::fs::read(&path)?);
        }
    }
    Ok(tables)
}

/// All files below a directory in the order of their names; none if it does not exist.
fn files(directory: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    if directory.is_dir() {
        for entry in std::fs::read_dir(directory)? {
            let path = entry?.path();
            if path.is_dir() {
                found.extend(files(&path)?);
            } else {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_not_compared() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("report")).unwrap();
        for name in ["cells.csv", "seconds.csv", "unit_seconds.csv", "fig02.svg"] {
            std::fs::write(dir.path().join("report").join(name), name).unwrap();
        }
        let tables = tables(dir.path()).unwrap();
        let own = ("report".to_string(), "cells.csv".to_string());
        assert_eq!(tables.keys().collect::<Vec<_>>(), [&own]);
    }
}
