//! The programs at work in a temporary directory, and the results that they leave.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, ensure};

use super::commands::Line;
use super::inputs::{Run, TABLES, Table, texts};
use crate::paths::root;
use crate::program;

/// A result: `<group>/<name>` and its bytes.
pub type Output = (String, Vec<u8>);

/// A directory with the inputs.
pub struct Session {
    directory: tempfile::TempDir,
}

impl Session {
    /// Simulates the runs and writes the tables and the other inputs.
    ///
    /// # Errors
    /// If a file cannot be written or a run cannot be simulated.
    pub fn new() -> anyhow::Result<Self> {
        let session = Self {
            directory: tempfile::tempdir()?,
        };
        for table in TABLES {
            session.write_table(table)?;
        }
        for (name, text) in texts() {
            session.write(name, &text)?;
        }
        Ok(session)
    }

    /// The runs as they were simulated, in the order of their names.
    ///
    /// # Errors
    /// If a run cannot be read.
    pub fn runs(&self) -> anyhow::Result<Vec<Output>> {
        let mut names: Vec<String> = TABLES
            .iter()
            .flat_map(|table| table.runs)
            .map(Run::name)
            .collect();
        names.sort();
        names.dedup();
        let read = |name: String| {
            let contents = self.read(&format!("{name}.csv"))?;
            Ok((format!("robot/{name}"), contents))
        };
        names.into_iter().map(read).collect()
    }

    /// The results of a command: the file that it writes and, with another name, what it prints.
    ///
    /// # Errors
    /// If the command fails; the message is its own.
    pub fn results(&self, line: &Line) -> anyhow::Result<Vec<Output>> {
        let printed = self.torque_gp(&line.arguments)?;
        let name = format!("{}/{}", line.group.name(), line.name);
        let mut results = Vec::new();
        let Some(file) = &line.output else {
            return Ok(vec![(name, printed)]);
        };
        if !printed.is_empty() {
            results.push((format!("{name}.printed"), printed));
        }
        results.push((name, self.read(file)?));
        Ok(results)
    }

    /// Directory of the inputs.
    pub fn directory(&self) -> &Path {
        self.directory.path()
    }

    fn write_table(&self, table: &Table) -> anyhow::Result<()> {
        let mut runs = Vec::new();
        for run in table.runs {
            let (name, Run(load, path, speed)) = (run.name(), run);
            let file = format!("{name}.csv");
            if !self.path(&file).exists() {
                self.torque_gp(&format!(
                    "simulate --load {load} --path {path} --speed {speed} --output {file}"
                ))?;
            }
            runs.push(String::from_utf8(self.read(&file)?)?);
        }
        self.write(&format!("{}.csv", table.name), &table.text(&runs))
    }

    /// Standard output of `torque-gp`.
    fn torque_gp(&self, arguments: &str) -> anyhow::Result<Vec<u8>> {
        let root = root().display().to_string();
        let arguments = arguments
            .split(' ')
            .map(|part| part.replace("{root}", &root));
        let mut command = Command::new(program::path("torque-gp")?);
        command.args(arguments).current_dir(self.directory());
        printed(&mut command)
    }

    fn path(&self, file: &str) -> PathBuf {
        self.directory().join(file)
    }

    fn read(&self, file: &str) -> anyhow::Result<Vec<u8>> {
        std::fs::read(self.path(file)).with_context(|| file.to_owned())
    }

    fn write(&self, file: &str, text: &str) -> anyhow::Result<()> {
        std::fs::write(self.path(file), text).with_context(|| file.to_owned())
    }
}

/// What a command writes to standard output.
///
/// # Errors
/// If it cannot be started or fails: the command and what it wrote to standard error.
pub fn printed(command: &mut Command) -> anyhow::Result<Vec<u8>> {
    let output = command.output().with_context(|| format!("{command:?}"))?;
    let message = String::from_utf8_lossy(&output.stderr);
    ensure!(
        output.status.success(),
        "{command:?} ended with {}\n{message}",
        output.status
    );
    Ok(output.stdout)
}
