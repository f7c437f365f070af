//! A lock for bits: results of both programs on fixed inputs, of which only hashes are compared.
//!
//! It knows commands, files and what is printed, and nothing of the code behind them, so the same list can be written
//! before a change of that code and checked after it, on the same machine.

mod commands;
mod group;
mod hashes;
mod inputs;
mod session;
mod smoke;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context;
use clap::ValueEnum;

pub use group::Group;

use crate::program;
use hashes::Hashes;
use session::{Output, Session};

/// Name of the list.
const LIST: &str = "bits.tsv";

/// Writes the list of hashes and the results into a directory.
///
/// Of other groups than those asked for, what the directory has stays.
///
/// # Errors
/// If a program cannot be built or fails, or a file cannot be written.
pub fn write(directory: &Path, only: &[Group]) -> anyhow::Result<ExitCode> {
    let (groups, names) = asked(only);
    let list = directory.join(LIST);
    let mut kept = if list.exists() {
        read(&list)?
    } else {
        Hashes::default()
    };
    kept.retain(&names, false);
    for name in &names {
        remove(&directory.join(name))?;
    }
    let results = results(&groups)?;
    for (name, contents) in &results {
        save(directory, name, contents)?;
    }
    let new = hashes(&results);
    say(&format!("{} results in {}", new.len(), list.display()));
    kept.extend(new);
    std::fs::write(&list, kept.text()).with_context(|| list.display().to_string())?;
    Ok(ExitCode::SUCCESS)
}

/// Computes the results again and says which are not those of the directory.
///
/// These are saved beside the programs, so that several checkouts can be checked against one directory at a time.
///
/// # Errors
/// If a program cannot be built or fails, or a file cannot be read.
pub fn check(directory: &Path, only: &[Group]) -> anyhow::Result<ExitCode> {
    let (groups, names) = asked(only);
    let mut before = read(&directory.join(LIST))?;
    before.retain(&names, true);
    let changed = program::path("bits-changed")?;
    remove(&changed)?;
    let results = results(&groups)?;
    let differences = hashes(&results).differences(&before);
    for difference in &differences {
        say(&format!("{} {}", difference.name, difference.what));
        if let Some(contents) = results.get(&difference.name) {
            save(&changed, &difference.name, contents)?;
        }
    }
    let (n, all) = (differences.len(), before.len());
    if n == 0 {
        say(&format!("{all} results are the same bits"));
        return Ok(ExitCode::SUCCESS);
    }
    say(&format!(
        "{n} differences to {all} results; what is there now is in {}",
        changed.display()
    ));
    Ok(ExitCode::FAILURE)
}

/// The groups asked for, all if none is named, and their names.
fn asked(only: &[Group]) -> (Vec<Group>, Vec<String>) {
    let groups = match only {
        [] => Group::value_variants().to_vec(),
        some => some.to_vec(),
    };
    let names = groups.iter().map(|group| group.name()).collect();
    (groups, names)
}

/// Every result of the groups by its name.
fn results(groups: &[Group]) -> anyhow::Result<BTreeMap<String, Vec<u8>>> {
    say("Building torque-gp and bench-suite in release mode.");
    program::build(&["torque-gp", "bench-suite"])?;
    let session = Session::new()?;
    let mut results = BTreeMap::new();
    let mut seconds: BTreeMap<Group, f64> = BTreeMap::new();
    let mut add = |group: Group, started: Instant, outputs: Vec<Output>| {
        results.extend(outputs);
        *seconds.entry(group).or_default() += started.elapsed().as_secs_f64();
    };
    if groups.contains(&Group::Robot) {
        add(Group::Robot, Instant::now(), session.runs()?);
    }
    for line in commands::lines(groups) {
        let started = Instant::now();
        let outputs = session.results(&line)?;
        // A model may only be there for other groups.
        let outputs = if groups.contains(&line.group) {
            outputs
        } else {
            Vec::new()
        };
        add(line.group, started, outputs);
    }
    if groups.contains(&Group::Smoke) {
        say("The smoke profile takes some minutes.");
        let started = Instant::now();
        add(Group::Smoke, started, smoke::results(session.directory())?);
    }
    for (group, seconds) in seconds {
        say(&format!("{}: {seconds:.1} s", group.name()));
    }
    Ok(results)
}

fn hashes(results: &BTreeMap<String, Vec<u8>>) -> Hashes {
    let mut hashes = Hashes::default();
    for (name, contents) in results {
        hashes.add(name.clone(), contents);
    }
    hashes
}

fn read(list: &Path) -> anyhow::Result<Hashes> {
    let shown = || list.display().to_string();
    let text = std::fs::read_to_string(list).with_context(shown)?;
    Hashes::read(&text).with_context(shown)
}

fn save(directory: &Path, name: &str, contents: &[u8]) -> anyhow::Result<()> {
    let path: PathBuf = directory.join(name);
    let shown = || path.display().to_string();
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).with_context(shown)?;
    }
    std::fs::write(&path, contents).with_context(shown)
}

/// Removes a directory, if it is there.
fn remove(directory: &Path) -> anyhow::Result<()> {
    if directory.exists() {
        let shown = || directory.display().to_string();
        std::fs::remove_dir_all(directory).with_context(shown)?;
    }
    Ok(())
}

#[expect(clippy::print_stdout, reason = "the list is what the command is for")]
fn say(text: &str) {
    println!("{text}");
}
