//! Stored results of an earlier revision: read, witnesses chosen among them, written under today's keys.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use toml::Value;

use super::differences::{differences, seconds};
use super::kept::Kept;
use crate::cell::Cell;
use crate::error::BenchError;
use crate::multi::shared::SharedUnit;
use crate::multi::unit::Unit;
use crate::section5::part::Part;
use crate::section5::transfer::Curve;
use crate::store::{Finished, parse, to_text, write_atomically};

/// One result, as today's program would keep it.
pub(super) struct Old {
    /// Where it was.
    path: PathBuf,
    /// What was done, in words.
    work: String,
    /// Today's key.
    pub key: String,
    /// What results of the same kind, model and size have in common.
    group: String,
    /// Today's file, below an output directory.
    file: PathBuf,
    /// Its text.
    text: String,
    /// The numbers in it.
    record: Value,
    is_witness: bool,
}

impl Old {
    /// Takes in the text of a file; `None` if it is no result of this kind of work.
    ///
    /// # Errors
    /// The reason why the result is not one of today's work.
    fn read<W: Kept>(path: &Path, text: &str) -> Option<Result<Self, String>> {
        let (key, record) = parse::<W::Record>(text)?;
        Some(Self::of::<W>(path, &key, record))
    }

    fn of<W: Kept>(path: &Path, key: &str, record: W::Record) -> Result<Self, String> {
        let record = W::renewed(record).map_err(|error| error.to_string())?;
        let work = record.work();
        if without_fingerprints(key) != without_fingerprints(&work.key()) {
            return Err("its key differs from today's in more than the fingerprints".to_string());
        }
        let directory = work.directory(Path::new(""));
        let directory = directory.map_err(|error| error.to_string())?;
        Ok(Self {
            path: path.to_path_buf(),
            work: work.to_string(),
            key: work.key(),
            group: work.group(),
            file: directory.join(work.file_name()),
            text: to_text(&record).map_err(|error| error.to_string())?,
            record: Value::try_from(&record).map_err(|error| error.to_string())?,
            is_witness: false,
        })
    }

    /// The result of the same work that today's program keeps in an output directory.
    fn kept_in(&self, output: &Path) -> Option<Value> {
        let text = std::fs::read_to_string(output.join(&self.file)).ok()?;
        let (key, record) = parse::<Value>(&text)?;
        (key == self.key).then_some(record)
    }

    /// Whether it is an experiment of section 5 that it belongs to.
    pub fn is_of_section5(&self) -> bool {
        self.file.starts_with("section5")
    }
}

/// All results, of every kind of work.
#[derive(Default)]
pub(super) struct Olds {
    found: Vec<Old>,
    /// Results that today's program has already.
    pub n_there: usize,
}

impl Olds {
    /// Takes in the text of a file; of section 5 only work of the `known` keys.
    ///
    /// # Errors
    /// The reason why it is not a result of today's work.
    pub fn read(
        &mut self,
        path: &Path,
        text: &str,
        output: &Path,
        known: &BTreeSet<String>,
    ) -> Result<(), String> {
        let old = (Old::read::<Cell>(path, text))
            .or_else(|| Old::read::<Unit>(path, text))
            .or_else(|| Old::read::<SharedUnit>(path, text))
            .or_else(|| Old::read::<Curve>(path, text))
            .or_else(|| Old::read::<Part>(path, text));
        let old = old.ok_or("not a whole result of a known kind")??;
        if old.is_of_section5() && !known.contains(&old.key) {
            return Err("no experiment of today has such a part".to_string());
        }
        if old.kept_in(output).is_some() {
            self.n_there += 1;
        } else {
            self.found.push(old);
        }
        Ok(())
    }

    /// Leaves one result of each piece of work, and says where two are not the same.
    pub fn contradictions(&mut self) -> Vec<String> {
        let mut by_key: BTreeMap<String, Old> = BTreeMap::new();
        let mut lines = Vec::new();
        for old in self.found.drain(..) {
            let Some(first) = by_key.get(&old.key) else {
                by_key.insert(old.key.clone(), old);
                continue;
            };
            let files = format!("{} and {}", first.path.display(), old.path.display());
            let found = differences(&first.record, &old.record).into_iter();
            lines.extend(found.map(|line| format!("{files}: {line}")));
        }
        self.found = by_key.into_values().collect();
        lines
    }

    /// Chooses the cheapest results of each group.
    pub fn choose_witnesses(&mut self, n: usize) {
        let mut groups: BTreeMap<String, Vec<&mut Old>> = BTreeMap::new();
        for old in &mut self.found {
            groups.entry(old.group.clone()).or_default().push(old);
        }
        for mut group in groups.into_values() {
            group.sort_by(|a, b| seconds(&a.record).total_cmp(&seconds(&b.record)));
            for old in group.into_iter().take(n) {
                old.is_witness = true;
            }
        }
    }

    /// The results that are computed again.
    pub fn witnesses(&self) -> impl Iterator<Item = &Old> {
        self.found.iter().filter(|old| old.is_witness)
    }

    /// The work of one kind that is computed again.
    pub fn witnessed<W: Kept>(&self) -> BTreeSet<W> {
        let olds = self.witnesses();
        let records = olds.filter_map(|old| parse::<W::Record>(&old.text));
        records.map(|(_, record)| record.work().clone()).collect()
    }

    /// The result of a piece of work.
    pub fn of<W: Kept>(&self, work: &W) -> Option<W::Record> {
        let key = work.key();
        let old = self.found.iter().find(|old| old.key == key)?;
        parse(&old.text).map(|(_, record)| record)
    }

    /// What is not the same in the witnesses, of section 5 or others, that were computed into another output directory.
    ///
    /// Of section 5 it names what could not be computed; of the others the run has said why.
    pub fn compared(&self, of_section5: bool, output: &Path) -> Vec<String> {
        let olds = self.witnesses();
        let olds = olds.filter(|old| old.is_of_section5() == of_section5);
        let lines = olds.flat_map(|old| {
            let lines = match old.kept_in(output) {
                Some(new) => differences(&old.record, &new),
                None if of_section5 => vec!["cannot be computed".to_string()],
                None => Vec::new(),
            };
            let work = &old.work;
            lines.into_iter().map(move |line| format!("{work}: {line}"))
        });
        lines.collect()
    }

    /// Writes all results under today's keys; how many.
    pub fn write(&self, output: &Path) -> Result<usize, BenchError> {
        for old in &self.found {
            let path = output.join(&old.file);
            let directory = path.parent().unwrap_or(output);
            std::fs::create_dir_all(directory).map_err(BenchError::io(directory))?;
            if old.kept_in(output).is_none() {
                write_atomically(&path, old.text.as_bytes())?;
            }
        }
        Ok(self.found.len())
    }
}

/// A key without the fingerprints in it.
fn without_fingerprints(key: &str) -> String {
    let fields = key.split("; ").map(|field| {
        let named = ["measured by ", "shared by "];
        let is_fingerprint = named.iter().find(|name| field.starts_with(*name));
        is_fingerprint.map_or(field, |name| *name)
    });
    fields.collect::<Vec<_>>().join("; ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_alike_if_only_fingerprints_differ() {
        let key = |fingerprint: &str, n: usize| {
            format!(
                "format 1; shared by {fingerprint}; ranks [2]; format 1; measured by {fingerprint}; n {n}"
            )
        };
        let plain = |fingerprint, n| without_fingerprints(&key(fingerprint, n));
        assert_eq!(plain("0a", 20), plain("ff", 20));
        assert_ne!(plain("0a", 20), plain("0a", 21));
    }
}
