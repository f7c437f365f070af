//! Runs the program in a directory of its own.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;

use assert_cmd::Command;
use tempfile::TempDir;

/// A temporary directory and the program started in it.
pub struct Folder {
    dir: TempDir,
}

impl Folder {
    pub fn new() -> Self {
        Self {
            dir: TempDir::new().unwrap(),
        }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        fs::write(self.path(name), contents).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Names of all files, sorted.
    pub fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.dir.path()).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// The program in this directory, its arguments separated by blanks.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("torque-gp").unwrap();
        command
            .current_dir(self.dir.path())
            .args(arguments.split_whitespace());
        command
    }

    /// Runs and expects success; returns standard error.
    pub fn run(&self, arguments: &str) -> String {
        let output = self.command(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments}: {}", stderr(&output));
        stderr(&output)
    }

    /// nMSE of every joint of a model on data, in order, and standard error.
    pub fn evaluate(&self, model: &str, data: &str) -> (Vec<f64>, String) {
        let arguments = format!("evaluate --model {model} --data {data} --json");
        let output = self.command(&arguments).output().unwrap();
        let said = stderr(&output);
        assert!(output.status.success(), "{said}");
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        let joints = json["joints"].as_array().unwrap().iter();
        let errors = joints.map(|joint| joint["nmse"].as_f64().unwrap());
        (errors.collect(), said)
    }

    /// Runs and expects status 2, nothing on standard output, no new or changed file; returns the message.
    pub fn refuse(&self, arguments: &str) -> String {
        let before: Vec<_> = self
            .files()
            .into_iter()
            .map(|name| (fs::read(self.path(&name)).ok(), name))
            .collect();
        let output = self.command(arguments).output().unwrap();
        let after: Vec<_> = self
            .files()
            .into_iter()
            .map(|name| (fs::read(self.path(&name)).ok(), name))
            .collect();
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments}: {message}");
        assert!(output.stdout.is_empty(), "{arguments}");
        assert!(before == after, "{arguments} left or changed a file");
        message
    }

    /// The one line of a refusal, without `error: `; warnings before it are allowed.
    pub fn refusal(&self, arguments: &str) -> String {
        let message = self.refuse(arguments);
        let errors: Vec<&str> = message
            .lines()
            .filter(|line| !line.starts_with("warning: "))
            .collect();
        assert_eq!(errors.len(), 1, "{message}");
        errors[0].strip_prefix("error: ").unwrap().to_owned()
    }
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// A file of the repository.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures")
        .join(name)
}

/// Columns of a CSV text by name, as numbers.
pub fn column(text: &str, name: &str) -> Vec<f64> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let idx = reader
        .headers()
        .unwrap()
        .iter()
        .position(|header| header == name);
    let idx = idx.unwrap_or_else(|| {
        panic!(
            "no column {name} in {}",
            text.lines().next().unwrap_or_default()
        )
    });
    reader
        .records()
        .map(|record| record.unwrap()[idx].parse().unwrap())
        .collect()
}

/// The header of a PUMA 560 state file.
pub fn state_header() -> String {
    let columns = ["q", "qd", "qdd"]
        .iter()
        .flat_map(|quantity| (1..=6).map(move |joint| format!("{quantity}{joint}")));
    columns.collect::<Vec<_>>().join(",")
}

/// A state file of the PUMA 560 with the given rows.
pub fn states(rows: &[[f64; 18]]) -> String {
    let lines = rows
        .iter()
        .map(|row| row.map(|value| format!("{value:?}")).join(","));
    std::iter::once(state_header())
        .chain(lines)
        .map(|line| line + "\n")
        .collect()
}
