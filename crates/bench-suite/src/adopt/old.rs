//! Stored results of one kind of work: read, witnesses chosen among them, written under today's keys.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::differences::{differences, seconds};
use super::kept::Kept;
use crate::error::BenchError;
use crate::run::RunOutcome;
use crate::store::{Finished, Store, Work, parse};

/// One result of an earlier revision.
pub(super) struct Old<W: Work> {
    path: PathBuf,
    /// As today's program would name it.
    pub record: W::Record,
    is_witness: bool,
}

/// All results of a kind.
pub(super) struct Olds<W: Work> {
    pub found: Vec<Old<W>>,
    /// Results that today's program has already.
    pub n_there: usize,
}

impl<W: Work> Default for Olds<W> {
    fn default() -> Self {
        Self {
            found: Vec::new(),
            n_there: 0,
        }
    }
}

impl<W: Kept> Olds<W> {
    /// Takes in the text of a file; `None` if it is no result of this kind.
    ///
    /// # Errors
    /// The reason why the result is not one of today's work.
    pub fn read(
        &mut self,
        path: &Path,
        text: &str,
        output: &Path,
        is_known: impl Fn(&str) -> bool,
    ) -> Option<Result<(), String>> {
        let (key, record) = parse::<W::Record>(text)?;
        Some(self.take(path, &key, record, output, is_known))
    }

    fn take(
        &mut self,
        path: &Path,
        key: &str,
        record: W::Record,
        output: &Path,
        is_known: impl Fn(&str) -> bool,
    ) -> Result<(), String> {
        let record = W::renewed(record).map_err(|error| error.to_string())?;
        let today = record.work().key();
        if without_fingerprints(key) != without_fingerprints(&today) {
            return Err("its key differs from today's in more than the fingerprints".to_string());
        }
        if !is_known(&today) {
            return Err("no experiment of today has such a part".to_string());
        }
        let directory = (record.work().directory(output)).map_err(|error| error.to_string())?;
        if Store::at(directory).load(record.work()).is_some() {
            self.n_there += 1;
        } else {
            self.found.push(Old {
                path: path.to_path_buf(),
                record,
                is_witness: false,
            });
        }
        Ok(())
    }

    /// Leaves one result of each piece of work, and says where two are not the same.
    pub fn contradictions(&mut self) -> Vec<String> {
        let mut by_key: BTreeMap<String, Old<W>> = BTreeMap::new();
        let mut lines = Vec::new();
        for old in self.found.drain(..) {
            let key = old.record.work().key();
            let Some(first) = by_key.get(&key) else {
                by_key.insert(key, old);
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
        let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (idx, old) in self.found.iter().enumerate() {
            let group = old.record.work().group();
            groups.entry(group).or_default().push(idx);
        }
        for mut group in groups.into_values() {
            group.sort_by(|&a, &b| {
                let [a, b] = [a, b].map(|idx| &self.found[idx].record);
                let by_cost = || a.work().cost().cmp(&b.work().cost());
                seconds(a).total_cmp(&seconds(b)).then_with(by_cost)
            });
            for idx in group.into_iter().take(n) {
                self.found[idx].is_witness = true;
            }
        }
    }

    /// The results that are computed again.
    pub fn witnesses(&self) -> Vec<&W::Record> {
        let chosen = self.found.iter().filter(|old| old.is_witness);
        chosen.map(|old| &old.record).collect()
    }

    /// The work of the witnesses.
    pub fn witnessed<B: FromIterator<W>>(&self) -> B {
        let records = self.witnesses().into_iter();
        records.map(|record| record.work().clone()).collect()
    }

    /// What is not the same in the witnesses computed again.
    pub fn compared(&self, outcome: &RunOutcome<W>) -> Vec<String> {
        let mut lines = outcome.reasons();
        for new in &outcome.records {
            lines.extend(self.differences(new));
        }
        lines
    }

    /// The same of witnesses that were computed into a store of their own.
    pub fn compared_in(&self, output: &Path) -> Result<Vec<String>, BenchError> {
        let mut lines = Vec::new();
        for old in self.witnesses() {
            let work = old.work();
            match Store::at(work.directory(output)?).load(work) {
                Some(new) => lines.extend(self.differences(&new)),
                None => lines.push(format!("{work}: cannot be computed")),
            }
        }
        Ok(lines)
    }

    fn differences(&self, new: &W::Record) -> Vec<String> {
        let work = new.work();
        let olds = self.witnesses().into_iter();
        let of_work = olds.filter(|old| old.work() == work);
        of_work
            .flat_map(|old| differences(old, new))
            .map(|line| format!("{work}: {line}"))
            .collect()
    }

    /// Writes all results under today's keys; how many.
    pub fn write(&self, output: &Path) -> Result<usize, BenchError> {
        for old in &self.found {
            let work = old.record.work();
            let store = Store::open(work.directory(output)?)?;
            if store.load(work).is_none() {
                store.save(&old.record)?;
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
