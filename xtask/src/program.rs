//! Programs of the workspace, started in release mode.

use std::process::{Command, ExitCode};

use anyhow::Context;

use crate::paths::root;

/// Runs a command of `bench-suite` with the arguments as they are, and hands on its exit status.
///
/// # Errors
/// If cargo cannot be started.
pub fn bench_suite(command: &str, arguments: &[String]) -> anyhow::Result<ExitCode> {
    say("Building bench-suite in release mode; the first time takes about two minutes.");
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args([
            "run",
            "--quiet",
            "--release",
            "--locked",
            "--package",
            "bench-suite",
        ])
        .arg("--manifest-path")
        .arg(root().join("Cargo.toml"))
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

#[expect(clippy::print_stderr, reason = "a long silence needs an explanation")]
fn say(text: &str) {
    eprintln!("{text}");
}
