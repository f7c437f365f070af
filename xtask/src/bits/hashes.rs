//! Hashes of results by their names, and in what two lists of them differ.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use anyhow::Context;
use sha2::{Digest, Sha256};

/// SHA-256 of every result, by `<group>/<name>`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Hashes(BTreeMap<String, String>);

impl Hashes {
    /// Adds a result.
    pub fn add(&mut self, name: String, contents: &[u8]) {
        self.0.insert(name, sha256(contents));
    }

    /// Adds the results of another list, in the place of those that have the same names.
    pub fn extend(&mut self, other: Self) {
        self.0.extend(other.0);
    }

    /// Keeps the results of these groups, or of all others.
    pub fn retain(&mut self, groups: &[String], is_kept: bool) {
        self.0.retain(|name, _| {
            let group = name.split('/').next().unwrap_or_default();
            groups.iter().any(|of| of == group) == is_kept
        });
    }

    /// Number of results.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// One line a result: hash, two blanks, name; in the order of the names.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (name, hash) in &self.0 {
            // Writing to a string cannot fail.
            _ = writeln!(text, "{hash}  {name}");
        }
        text
    }

    /// What [`Self::text`] wrote.
    ///
    /// # Errors
    /// If a line is not a hash, two blanks and a name.
    pub fn read(text: &str) -> anyhow::Result<Self> {
        let line = |(i, line): (usize, &str)| {
            let parts = line.split_once("  ").filter(|(hash, _)| hash.len() == 64);
            let (hash, name) = parts.with_context(|| format!("line {}: {line:?}", i + 1))?;
            Ok((name.to_owned(), hash.to_owned()))
        };
        text.lines()
            .enumerate()
            .map(line)
            .collect::<anyhow::Result<_>>()
            .map(Self)
    }

    /// Every name whose result is another one than `before`, is new or is gone, in the order of the names.
    pub fn differences(&self, before: &Self) -> Vec<Difference> {
        let names: BTreeSet<&String> = self.0.keys().chain(before.0.keys()).collect();
        let difference = |name: &String| {
            let what = match (before.0.get(name), self.0.get(name)) {
                (Some(old), Some(new)) if old == new => return None,
                (Some(_), Some(_)) => "differs",
                (None, _) => "is new",
                (_, None) => "is gone",
            };
            Some(Difference {
                name: name.clone(),
                what,
            })
        };
        names.into_iter().filter_map(difference).collect()
    }
}

/// A result that is not what it was.
#[derive(Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its `<group>/<name>`.
    pub name: String,
    /// What became of it.
    pub what: &'static str,
}

fn sha256(contents: &[u8]) -> String {
    let digest = Sha256::digest(contents);
    digest.iter().fold(String::new(), |mut text, byte| {
        // Writing to a string cannot fail.
        _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hashes(results: &[(&str, &str)]) -> Hashes {
        let mut hashes = Hashes::default();
        for (name, contents) in results {
            hashes.add((*name).to_owned(), contents.as_bytes());
        }
        hashes
    }

    #[test]
    fn the_hash_is_that_of_the_standard() {
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
    }

    #[test]
    fn what_differs_is_new_or_is_gone_is_named_and_nothing_else() {
        let before = hashes(&[("a/same", "1"), ("a/other", "1"), ("b/gone", "1")]);
        let after = hashes(&[("a/same", "1"), ("a/other", "2"), ("b/new", "1")]);
        let found = after.differences(&before);
        let found: Vec<_> = found.iter().map(|d| (d.name.as_str(), d.what)).collect();
        assert_eq!(
            found,
            [
                ("a/other", "differs"),
                ("b/gone", "is gone"),
                ("b/new", "is new")
            ]
        );
        assert_eq!(before.differences(&before), []);
    }

    #[test]
    fn a_list_is_read_as_it_was_written_and_sorted_by_name() {
        let written = hashes(&[("b/y", "1"), ("a/x", "2")]);
        let text = written.text();
        let names: Vec<_> = text.lines().map(|line| &line[66..]).collect();
        assert_eq!(names, ["a/x", "b/y"]);
        assert_eq!(Hashes::read(&text).unwrap(), written);
        for wrong in ["a/x", "12  a/x"] {
            assert!(
                Hashes::read(wrong)
                    .unwrap_err()
                    .to_string()
                    .contains("line 1")
            );
        }
    }

    #[test]
    fn groups_are_told_apart_by_their_whole_name() {
        let mut some = hashes(&[("a/x", "1"), ("ab/x", "1"), ("b/x", "1")]);
        let mut others = some.clone();
        some.retain(&["a".to_owned()], true);
        others.retain(&["a".to_owned()], false);
        assert_eq!(some, hashes(&[("a/x", "1")]));
        assert_eq!(others, hashes(&[("ab/x", "1"), ("b/x", "1")]));
    }
}
