//! The files of a report, which appear together or not at all.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::error::BenchError;
use crate::report::text_table::TextTable;
use crate::store::write_atomically;

/// Ending of the name of a directory that is not complete.
const PARTIAL: &str = ".partial";
/// Age from which an incomplete directory is nobody's any more: writing one takes seconds.
const ABANDONED: Duration = Duration::from_hours(1);

/// Files of a report, kept in memory until all of them exist.
#[derive(Default)]
pub(super) struct Files(Vec<(String, Vec<u8>)>);

impl Files {
    pub fn add(&mut self, name: &str, contents: impl Into<Vec<u8>>) {
        self.0.push((name.to_string(), contents.into()));
    }

    /// The text of a file, if there is one of that name and it is text.
    pub fn text(&self, name: &str) -> Option<&str> {
        let (_, contents) = self.0.iter().find(|(file, _)| file == name)?;
        std::str::from_utf8(contents).ok()
    }

    /// The CSV files and their columns.
    pub fn columns(&self) -> TextTable {
        let tables = self.0.iter().filter(|(name, _)| is_csv(name));
        let row = |(name, _): &(String, Vec<u8>)| {
            let header = self.text(name).and_then(|text| text.lines().next());
            vec![name.clone(), header.unwrap_or_default().replace(',', ", ")]
        };
        TextTable::new(2, ["file", "columns"], tables.map(row))
    }

    /// Writes everything into a new directory, which appears only when it is complete.
    ///
    /// # Errors
    /// `Io` if a file cannot be written; then nothing is left.
    pub fn write(&self, output: &Path, name: &str) -> Result<PathBuf, BenchError> {
        remove_abandoned(output);
        let partial = output.join(format!(".{name}.{}{PARTIAL}", std::process::id()));
        let written = self
            .write_into(&partial)
            .and_then(|()| publish(&partial, output, name));
        if written.is_err() {
            // The reason for the failure is what the user needs; a directory that stays is hidden.
            drop(std::fs::remove_dir_all(&partial));
        }
        written
    }

    fn write_into(&self, directory: &Path) -> Result<(), BenchError> {
        std::fs::create_dir_all(directory).map_err(BenchError::io(directory))?;
        let mut files = self.0.iter();
        files.try_for_each(|(file, contents)| write_atomically(&directory.join(file), contents))
    }
}

fn is_csv(name: &str) -> bool {
    Path::new(name).extension().is_some_and(|e| e == "csv")
}

/// Gives a complete directory its name, or the name with the first number that makes it new.
fn publish(partial: &Path, output: &Path, name: &str) -> Result<PathBuf, BenchError> {
    let mut number = 1;
    loop {
        let directory = match number {
            1 => output.join(name),
            _ => output.join(format!("{name}-{number}")),
        };
        // A rename replaces an empty directory only, so another run's report is safe even if it appears just now.
        match std::fs::rename(partial, &directory) {
            Ok(()) => return Ok(directory),
            Err(_) if directory.exists() => number += 1,
            Err(error) => return Err(BenchError::io(&directory)(error)),
        }
    }
}

/// Removes what killed runs left; a failure to do so harms nobody.
fn remove_abandoned(output: &Path) {
    let Ok(entries) = std::fs::read_dir(output) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let age = entry
            .metadata()
            .and_then(|m| m.modified())
            .map(|t| t.elapsed());
        let is_old = age.is_ok_and(|age| age.is_ok_and(|age| age > ABANDONED));
        if name.starts_with('.') && name.ends_with(PARTIAL) && is_old {
            drop(std::fs::remove_dir_all(entry.path()));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_overwritten_and_nothing_partial_remains() {
        let dir = tempfile::tempdir().unwrap();
        let mut files = Files::default();
        files.add("a.txt", "a");
        let first = files.write(dir.path(), "run").unwrap();
        let second = files.write(dir.path(), "run").unwrap();
        assert_ne!(first, second);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
        assert_eq!(std::fs::read_to_string(second.join("a.txt")).unwrap(), "a");
    }

    #[test]
    fn a_failure_names_the_file_and_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let mut files = Files::default();
        files.add("a.txt", "a");
        files.add("missing/b.txt", "b"); // its directory does not exist
        let error = files.write(dir.path(), "run").unwrap_err().to_string();
        assert!(error.contains("missing/b.txt: "), "{error}");
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0);
    }

    #[test]
    fn what_a_killed_run_left_is_removed_when_it_is_old() {
        let dir = tempfile::tempdir().unwrap();
        let (old, new) = (
            dir.path().join(".a.1.partial"),
            dir.path().join(".b.2.partial"),
        );
        for path in [&old, &new] {
            std::fs::create_dir(path).unwrap();
            std::fs::write(path.join("report.md"), "").unwrap();
        }
        let file = std::fs::File::open(&old).unwrap();
        let then = std::fs::metadata(&new).unwrap().modified().unwrap() - 2 * ABANDONED;
        file.set_modified(then).unwrap();
        Files::default().write(dir.path(), "run").unwrap();
        assert!(!old.exists() && new.exists());
    }

    #[test]
    fn csv_files_are_listed_with_their_columns() {
        let mut files = Files::default();
        files.add("a.csv", "x,y\n1,2\n");
        files.add("a.svg", "<svg/>");
        assert_eq!(files.columns().rows, [["a.csv", "x, y"]]);
        assert_eq!(files.text("a.svg"), Some("<svg/>"));
    }
}
