//! Experiments of kind `data`: what a figure or table about the data is called and how it is read.

use serde::Deserialize;

use crate::error::BenchError;
use crate::experiment_file::{self, experiment_files};
use crate::spec::Prose;

/// Sources of the experiments, in the order of the chapter.
const SOURCES: [(&str, &str); 7] = experiment_files![
    "fig02.toml",
    "table1.toml",
    "fig03.toml",
    "fig04.toml",
    "fig05.toml",
    "fig06.toml",
    "table2.toml",
];

/// What an experiment works with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    /// The samples alone: no model, no profile, no seed.
    Data,
}

/// A figure or table about the data.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataExperiment {
    /// Name on the command line.
    pub name: String,
    /// Caption.
    pub title: String,
    /// Always `data`.
    kind: Kind,
    /// Prose.
    pub text: Prose,
}

impl DataExperiment {
    /// Every experiment of this kind, in the order of the chapter.
    ///
    /// # Errors
    /// `Experiment` if a description does not follow the format.
    pub fn all() -> Result<Vec<Self>, BenchError> {
        let parse = |(name, source): &(&str, &str)| experiment_file::parse(name, source);
        SOURCES.iter().map(parse).collect()
    }

    /// The names on the command line.
    ///
    /// # Errors
    /// As [`Self::all`].
    pub fn names() -> Result<Vec<String>, BenchError> {
        let all = Self::all()?;
        Ok(all.into_iter().map(|experiment| experiment.name).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_after_its_experiment() {
        let names = DataExperiment::names().unwrap();
        for (name, (file, _)) in names.iter().zip(SOURCES) {
            assert_eq!(format!("{name}.toml"), file);
        }
    }
}
