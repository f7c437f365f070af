//! The CSV files of the smoke profile.

use std::ffi::OsStr;
use std::path::Path;
use std::process::Command;

use anyhow::ensure;

use super::session::{Output, printed};
use crate::paths::files;
use crate::program;

/// Computes the whole smoke profile below a directory and reads its CSV files but those of seconds.
///
/// # Errors
/// If the program fails or writes no CSV file.
pub fn results(directory: &Path) -> anyhow::Result<Vec<Output>> {
    let output = directory.join("smoke");
    let mut command = Command::new(program::path("bench-suite")?);
    command.args(["reproduce-paper", "--profile", "smoke", "--from", "scratch"]);
    printed(command.arg("--output").arg(&output))?;
    let mut results = Vec::new();
    for path in files(&output, &["csv"])? {
        let name = path
            .file_name()
            .map(OsStr::to_string_lossy)
            .unwrap_or_default();
        if !name.ends_with("seconds.csv") {
            let text = std::fs::read_to_string(&path)?;
            results.push((format!("smoke/{name}"), without_records(&text).into_bytes()));
        }
    }
    ensure!(!results.is_empty(), "the smoke profile wrote no CSV file");
    Ok(results)
}

/// The table without its last column if that is `record`: names of files, which say where a result was kept.
fn without_records(text: &str) -> String {
    let has_records = text
        .lines()
        .next()
        .is_some_and(|header| header.ends_with(",record"));
    let shortened = |line: &str| match line.rsplit_once(',') {
        Some((rest, _)) if has_records => format!("{rest}\n"),
        _ => format!("{line}\n"),
    };
    text.lines().map(shortened).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_of_records_are_left_out() {
        assert_eq!(without_records("a,b,record\n1,2,x.toml\n"), "a,b\n1,2\n");
        assert_eq!(without_records("a,records\n1,2\n"), "a,records\n1,2\n");
    }
}
