//! Programs of the workspace, started in release mode.

use std::path::PathBuf;
use std::process::{Command, ExitCode};

use anyhow::{Context, ensure};

use crate::paths::root;

/// Runs a command of `bench-suite` with the arguments as they are, and hands on its exit status.
///
/// # Errors
/// If cargo cannot be started.
pub fn bench_suite(command: &str, arguments: &[String]) -> anyhow::Result<ExitCode> {
    say("Building bench-suite in release mode; the first time takes about two minutes.");
    let status = cargo("run")
        .args(["--", command])
        .args(arguments)
        .status()
        .context("cannot start cargo")?;
    // A signal leaves no code; 1 then says that the command did not end well.
    Ok(match status.code().map(u8::try_from) {
        Some(Ok(code)) => ExitCode::from(code),
        _ => ExitCode::FAILURE,
    })
}

/// Builds `bench-suite` without running it.
///
/// # Errors
/// If cargo cannot be started or the build fails.
pub fn build_bench_suite() -> anyhow::Result<()> {
    let status = cargo("build").status().context("cannot start cargo")?;
    ensure!(status.success(), "bench-suite cannot be built");
    Ok(())
}

/// The program that [`build_bench_suite`] made: it stands beside this one.
///
/// # Errors
/// If the system does not say where this program is.
pub fn bench_suite_path() -> anyhow::Result<PathBuf> {
    let this = std::env::current_exe().context("where is this program?")?;
    Ok(this.with_file_name("bench-suite"))
}

/// A cargo command for `bench-suite` in release mode.
fn cargo(command: &str) -> Command {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut cargo = Command::new(cargo);
    cargo.args([
        command,
        "--quiet",
        "--release",
        "--locked",
        "--package",
        "bench-suite",
    ]);
    cargo.arg("--manifest-path").arg(root().join("Cargo.toml"));
    cargo
}

#[expect(clippy::print_stderr, reason = "a long silence needs an explanation")]
fn say(text: &str) {
    eprintln!("{text}");
}
