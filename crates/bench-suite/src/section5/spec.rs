//! Experiments of kind `section5`: what they are called, and the settings of each profile.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::BenchError;
use crate::experiment_file::{self, experiment_files};
use crate::spec::{Profile, Prose};

/// Name that chooses all of them on the command line.
pub const GROUP: &str = "section5";

/// Sources of the experiments, in the order in which they are made.
const SOURCES: [(&str, &str); 7] = experiment_files![
    "models.toml",
    "context.toml",
    "novel.toml",
    "transfer.toml",
    "rbd.toml",
    "sampled.toml",
    "closed_loop.toml",
];

/// What an experiment works with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    /// Models of many loads, fitted once for all experiments.
    Section5,
}

/// An experiment beyond the chapter's own.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section5Experiment {
    /// Name on the command line.
    pub name: String,
    /// Caption.
    pub title: String,
    /// Always `section5`.
    kind: Kind,
    /// Settings of each profile, which the experiment's module reads.
    profile: BTreeMap<Profile, toml::Table>,
    /// Prose.
    pub text: Prose,
}

impl Section5Experiment {
    /// Every experiment of this kind, in the order in which they are made.
    ///
    /// # Errors
    /// `Experiment` if a description does not follow the format.
    pub fn all() -> Result<Vec<Self>, BenchError> {
        let parse = |(name, source): &(&str, &str)| Self::parse(name, source);
        SOURCES.iter().map(parse).collect()
    }

    /// Reads one description.
    ///
    /// # Errors
    /// `Experiment` if it is not TOML of this format.
    pub fn parse(name: &str, source: &str) -> Result<Self, BenchError> {
        experiment_file::parse(name, source)
    }

    /// The names on the command line.
    ///
    /// # Errors
    /// As [`Self::all`].
    pub fn names() -> Result<Vec<String>, BenchError> {
        let all = Self::all()?;
        Ok(all.into_iter().map(|experiment| experiment.name).collect())
    }

    /// Settings of a profile, in the form that the experiment's module asks for.
    ///
    /// # Errors
    /// `Experiment` if the profile is missing, or its settings are not of that form.
    pub fn settings<T: DeserializeOwned>(&self, profile: Profile) -> Result<T, BenchError> {
        let refuse = |message: String| {
            BenchError::experiment(&self.name, format!("profile {}: {message}", profile.name()))
        };
        let table = self.profile.get(&profile);
        let table = table.ok_or_else(|| refuse("missing".to_string()))?;
        let settings = table.clone().try_into();
        settings.map_err(|error: toml::de::Error| refuse(error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_after_its_experiment_and_has_both_profiles() {
        for (experiment, (file, _)) in Section5Experiment::all().unwrap().iter().zip(SOURCES) {
            assert_eq!(format!("{}.toml", experiment.name), file);
            assert_eq!(experiment.profile.len(), 2, "{file}");
        }
    }

    #[test]
    fn settings_that_no_module_reads_are_refused() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Other {}
        let models = &Section5Experiment::all().unwrap()[0];
        let error = models.settings::<Other>(Profile::Smoke).unwrap_err();
        let message = error.to_string();
        assert!(
            message.starts_with("experiment models: profile smoke: unknown field `n_total`"),
            "{message}"
        );
    }
}
