//! Experiments that make one section of the report each: those of kind `data` and those of kind `section5`.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::error::BenchError;
use crate::experiment_file::{self, experiment_files};
use crate::spec::{Profile, Prose};

/// Sources of the experiments: those about the data in the order of the chapter, the others in that in which they are
/// made.
const SOURCES: [(&str, &str); 14] = experiment_files![
    "fig02.toml",
    "table1.toml",
    "fig03.toml",
    "fig04.toml",
    "fig05.toml",
    "fig06.toml",
    "table2.toml",
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
pub enum Kind {
    /// The samples alone: no model, no profile, no seed.
    Data,
    /// Models of many loads, fitted once for all experiments; beyond the chapter's own.
    Section5,
}

/// A figure or table about the data, or an experiment beyond the chapter's own.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SectionExperiment {
    /// Name on the command line.
    pub name: String,
    /// Caption.
    pub title: String,
    /// What it works with.
    pub kind: Kind,
    /// Settings of each profile, which the experiment's module reads.
    #[serde(default)]
    profile: BTreeMap<Profile, toml::Table>,
    /// Prose.
    pub text: Prose,
}

impl SectionExperiment {
    /// Every experiment of a kind, in the order in which they are made.
    ///
    /// # Errors
    /// `Experiment` if a description does not follow the format.
    pub fn all(kind: Kind) -> Result<Vec<Self>, BenchError> {
        let parse = |(name, source): &(&str, &str)| Self::parse(name, source);
        let mut all = SOURCES.iter().map(parse).collect::<Result<Vec<_>, _>>()?;
        all.retain(|experiment| experiment.kind == kind);
        Ok(all)
    }

    /// Reads one description.
    ///
    /// # Errors
    /// `Experiment` if it is not TOML of this format.
    pub fn parse(name: &str, source: &str) -> Result<Self, BenchError> {
        experiment_file::parse(name, source)
    }

    /// The names of a kind on the command line.
    ///
    /// # Errors
    /// As [`Self::all`].
    pub fn names(kind: Kind) -> Result<Vec<String>, BenchError> {
        let all = Self::all(kind)?;
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

    /// The profiles that it has settings of.
    pub fn profiles(&self) -> impl Iterator<Item = Profile> {
        self.profile.keys().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_after_its_experiment_and_has_the_profiles_of_its_kind() {
        let [data, section5] =
            [Kind::Data, Kind::Section5].map(|kind| SectionExperiment::all(kind).unwrap());
        for (experiment, (file, _)) in data.iter().chain(&section5).zip(SOURCES) {
            assert_eq!(format!("{}.toml", experiment.name), file);
            let n_profiles = if experiment.kind == Kind::Data { 0 } else { 2 };
            assert_eq!(experiment.profile.len(), n_profiles, "{file}");
        }
    }

    #[test]
    fn settings_that_no_module_reads_are_refused() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Other {}
        let models = &SectionExperiment::all(Kind::Section5).unwrap()[0];
        let error = models.settings::<Other>(Profile::Smoke).unwrap_err();
        let message = error.to_string();
        assert!(
            message.starts_with("experiment models: profile smoke: unknown field `n_total`"),
            "{message}"
        );
    }
}
