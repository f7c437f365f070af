//! The files of a report, which appear together or not at all.

use std::path::{Path, PathBuf};

use crate::error::BenchError;
use crate::store::write_atomically;

/// Files of a report, kept in memory until all of them exist.
#[derive(Default)]
pub(super) struct Files(Vec<(String, Vec<u8>)>);

impl Files {
    pub fn add(&mut self, name: &str, contents: impl Into<Vec<u8>>) {
        self.0.push((name.to_string(), contents.into()));
    }

    /// Writes everything into a new directory, which appears only when it is complete.
    pub fn write(&self, output: &Path, name: &str) -> Result<PathBuf, BenchError> {
        let partial = output.join(format!(".{name}.{}.partial", std::process::id()));
        std::fs::create_dir_all(&partial).map_err(BenchError::io(&partial))?;
        for (file, contents) in &self.0 {
            write_atomically(&partial.join(file), contents)?;
        }
        let directory = free_name(output, name);
        std::fs::rename(&partial, &directory).map_err(BenchError::io(&directory))?;
        Ok(directory)
    }
}

/// The name, or the name with the first number that makes it new.
fn free_name(output: &Path, name: &str) -> PathBuf {
    let numbered = (2..).map(|i| output.join(format!("{name}-{i}")));
    let mut candidates = std::iter::once(output.join(name)).chain(numbered);
    let is_free = |path: &PathBuf| !path.exists();
    candidates
        .find(is_free)
        .unwrap_or_else(|| output.join(name))
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
}
