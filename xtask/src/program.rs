//! Programs of the workspace, started in release mode.

use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context, ensure};

use crate::paths::root;

/// Runs a command of `bench-suite` with the arguments as they are, and hands on its exit status.
///
/// # Errors
/// If cargo or the program cannot be started, or the build fails.
pub fn bench_suite(command: &str, arguments: &[String]) -> anyhow::Result<ExitCode> {
    say("Building bench-suite in release mode; the first time takes about two minutes.");
    build(&["bench-suite"])?;
    let mut program = Command::new(path("bench-suite")?);
    let status = program.arg(command).args(arguments).status();
    let status = status.context("cannot start bench-suite")?;
    // A signal leaves no code; 1 then says that the command did not end well.
    Ok(match status.code().map(u8::try_from) {
        Some(Ok(code)) => ExitCode::from(code),
        _ => ExitCode::FAILURE,
    })
}

/// Builds programs of the workspace in release mode, without running them.
///
/// Out of the whole workspace: with another selection of packages their dependencies would have other features,
/// and be built once more beside those of `cargo build --release`.
///
/// # Errors
/// If cargo cannot be started or the build fails.
pub fn build(names: &[&str]) -> anyhow::Result<()> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut cargo = Command::new(cargo);
    cargo.args(["build", "--quiet", "--release", "--locked", "--workspace"]);
    cargo.args(names.iter().flat_map(|name| ["--bin", name]));
    cargo.arg("--manifest-path").arg(root().join("Cargo.toml"));
    let status = cargo.status().context("cannot start cargo")?;
    ensure!(status.success(), "{} cannot be built", names.join(", "));
    Ok(())
}

/// A program that [`build`] made: it stands beside this one.
///
/// # Errors
/// If the system does not say where this program is.
pub fn path(name: &str) -> anyhow::Result<PathBuf> {
    let this = std::env::current_exe().context("where is this program?")?;
    Ok(this.with_file_name(name))
}

#[expect(clippy::print_stderr, reason = "a long silence needs an explanation")]
fn say(text: &str) {
    eprintln!("{text}");
}
