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
    let mut found = Found::read(request, &scratch.keys_of_section5()?)?;
    let mut differences = found.results.contradictions();
    differences.extend(found.models.contradictions.clone());
    if differences.is_empty() {
        found.results.choose_witnesses(request.n_witnesses);
        differences = scratch.differences(&found)?;
    }
    let n_adopted = if differences.is_empty() {
        found.models.write(&request.output)? + found.results.write(&request.output)?
    } else {
        0
    };
    Ok(Adoption {
        n_adopted,
        n_there: found.results.n_there + found.models.n_there,
        n_witnesses: found.results.witnesses().count() + found.models.witnesses().len(),
        differences,
        unread: found.unread,
    })
}

impl Found {
    /// Reads every file of results; of section 5 those of the `known` keys.
    fn read(request: &Request, known: &BTreeSet<String>) -> Result<Self, BenchError> {
        let mut results = Olds::default();
        let mut models = OldModels::of(&request.experiments)?;
        let mut unread = Vec::new();
        let files = files_of_results(&request.from)?;
        if files.is_empty() {
            return Err(BenchError::malformed(&request.from, "no result is in it"));
        }
        for path in &files {
            let read = std::fs::read(path).map_err(|error| error.to_string());
            let taken = read.and_then(|bytes| {
                if is_model(path) {
                    return models.read(path, bytes, &request.output);
                }
                let text = String::from_utf8_lossy(&bytes);
                results.read(path, &text, &request.output, known)
            });
            if let Err(reason) = taken {
                unread.push(format!("{}: {reason}", path.display()));
            }
        }
        unread.extend(models.remove_incomplete());
        Ok(Self {
            results,
            models,
            unread,
        })
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
