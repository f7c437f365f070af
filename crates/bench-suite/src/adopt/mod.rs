//! `adopt`: results of an earlier revision under today's keys, if today's program computes them to the bit.
//!
//! A move of files changes the fingerprints in all keys and no number.
//! Of each kind of work, model and size the cheapest results are computed again; only if every number of these
//! witnesses is the same, seconds aside, all results are written again under the keys of today.

mod differences;
mod kept;
mod models;
mod old;
mod request;
mod witnesses;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use self::models::OldModels;
use self::old::Olds;
use self::request::Found;
pub use self::request::Request;
use self::witnesses::Scratch;
use crate::error::BenchError;

/// Directories of results inside one output directory.
const KINDS: [&str; 4] = ["cells", "units", "section5", "models"];

/// What came of it.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Adoption {
    /// Results and model files written under today's keys.
    pub n_adopted: usize,
    /// Results and model files that today's program has already.
    pub n_there: usize,
    /// Results and joints' models that were computed again.
    pub n_witnesses: usize,
    /// Numbers that are not the same, with old and new value; if there is one, nothing is adopted.
    pub differences: Vec<String>,
    /// Files that were left, with the reason.
    pub unread: Vec<String>,
}

/// Adopts the results of an earlier revision, all of them or none.
///
/// # Errors
/// `Io` if a directory cannot be read or a result not be kept; `Malformed` if there is no result in it;
/// those of the work that is computed again, where it is not one piece that fails.
pub fn adopt(request: &Request) -> Result<Adoption, BenchError> {
    let scratch = Scratch::new(request)?;
    let mut found = Found::read(request, &scratch)?;
    let mut differences = found.contradictions();
    if differences.is_empty() {
        found.choose_witnesses(request.n_witnesses);
        differences = scratch.differences(&found)?;
    }
    let mut adoption = Adoption {
        n_there: found.n_there(),
        n_witnesses: found.n_witnesses(),
        n_adopted: 0,
        differences,
        unread: std::mem::take(&mut found.unread),
    };
    if adoption.differences.is_empty() {
        adoption.n_adopted = found.write(&request.output)?;
    }
    Ok(adoption)
}

impl Found {
    /// Reads every file of results.
    fn read(request: &Request, scratch: &Scratch) -> Result<Self, BenchError> {
        let mut found = Self {
            cells: Olds::default(),
            units: Olds::default(),
            shared: Olds::default(),
            curves: Olds::default(),
            parts: Olds::default(),
            models: OldModels::of(&request.experiments)?,
            unread: Vec::new(),
        };
        let known = scratch.keys_of_section5()?;
        let files = files_of_results(&request.from)?;
        for path in &files {
            if let Err(reason) = found.read_file(path, &request.output, &known) {
                found.unread.push(format!("{}: {reason}", path.display()));
            }
        }
        found.unread.extend(found.models.remove_incomplete());
        if files.is_empty() {
            return Err(BenchError::malformed(&request.from, "no result is in it"));
        }
        Ok(found)
    }

    fn read_file(
        &mut self,
        path: &Path,
        output: &Path,
        known: &BTreeSet<String>,
    ) -> Result<(), String> {
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        if is_model(path) {
            return self.models.read(path, &bytes, output);
        }
        let text = String::from_utf8_lossy(&bytes);
        let is_known = |key: &str| known.contains(key);
        let read = (self.cells.read(path, &text, output, |_| true))
            .or_else(|| self.units.read(path, &text, output, |_| true))
            .or_else(|| self.shared.read(path, &text, output, |_| true))
            .or_else(|| self.curves.read(path, &text, output, is_known))
            .or_else(|| self.parts.read(path, &text, output, is_known));
        read.unwrap_or_else(|| Err("not a whole result of a known kind".to_string()))
    }

    /// Two old results of the same work that are not the same.
    fn contradictions(&mut self) -> Vec<String> {
        [
            self.cells.contradictions(),
            self.units.contradictions(),
            self.shared.contradictions(),
            self.curves.contradictions(),
            self.parts.contradictions(),
            self.models.contradictions(),
        ]
        .concat()
    }

    fn choose_witnesses(&mut self, n: usize) {
        self.cells.choose_witnesses(n);
        self.units.choose_witnesses(n);
        self.shared.choose_witnesses(n);
        self.curves.choose_witnesses(n);
        self.parts.choose_witnesses(n);
    }

    fn n_witnesses(&self) -> usize {
        self.cells.witnesses().len()
            + self.units.witnesses().len()
            + self.shared.witnesses().len()
            + self.curves.witnesses().len()
            + self.parts.witnesses().len()
            + self.models.witnesses().len()
    }

    fn n_there(&self) -> usize {
        self.cells.n_there
            + self.units.n_there
            + self.shared.n_there
            + self.curves.n_there
            + self.parts.n_there
            + self.models.n_there
    }

    /// Writes everything under today's keys; how many files.
    fn write(&self, output: &Path) -> Result<usize, BenchError> {
        Ok(self.models.write(output)?
            + self.cells.write(output)?
            + self.units.write(output)?
            + self.shared.write(output)?
            + self.curves.write(output)?
            + self.parts.write(output)?)
    }
}

/// Files of results below the directories that an output directory keeps them in, or below the directory itself.
fn files_of_results(from: &Path) -> Result<Vec<PathBuf>, BenchError> {
    let inside = KINDS.map(|kind| from.join(kind));
    let mut files = Vec::new();
    if inside.iter().any(|directory| directory.is_dir()) {
        for directory in inside.iter().filter(|directory| directory.is_dir()) {
            add_files(directory, &mut files)?;
        }
    } else {
        add_files(from, &mut files)?;
    }
    files.sort();
    Ok(files)
}

fn add_files(directory: &Path, files: &mut Vec<PathBuf>) -> Result<(), BenchError> {
    for entry in std::fs::read_dir(directory).map_err(BenchError::io(directory))? {
        let path = entry.map_err(BenchError::io(directory))?.path();
        if path.is_dir() {
            add_files(&path, files)?;
        } else if is_model(&path) || path.extension().is_some_and(|e| e == "toml") {
            files.push(path);
        }
    }
    Ok(())
}

fn is_model(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "tgp")
}
