//! Experiments as data: which cells a table or figure needs, and what is expected of it.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

use crate::cell::{Cell, ModelKind};
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::experiment_file::{self, check, experiment_files};
use crate::split::UNIQUE;

/// Sources of the experiments.
const SOURCES: [(&str, &str); 3] = experiment_files!["table3.toml", "fig07.toml", "fig08.toml"];

/// Training samples of a load, the largest size.
pub const MAX_SIZE: usize = 4000;

/// How much of an experiment to run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Profile {
    /// Minutes: joints 1, 3, 6 at n = 20 and 170.
    Smoke,
    /// Everything that the chapter reports.
    Full,
}

impl Profile {
    /// smoke or full.
    pub fn name(self) -> &'static str {
        match self {
            Self::Smoke => "smoke",
            Self::Full => "full",
        }
    }
}

/// Loads, joints and sizes of a run, all from 1 as in the chapter.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scope {
    /// Loads c1..c15.
    pub loads: Vec<usize>,
    /// Joints 1..6.
    pub joints: Vec<usize>,
    /// Training-set sizes.
    pub sizes: Vec<usize>,
}

/// What is expected of the published rows.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Model whose rows are checked.
    pub reference_model: ModelKind,
    /// Largest accepted ratio of ours to the published value.
    pub worse_at_most: f64,
    /// Training-set size of the check.
    pub size: usize,
}

/// One table or figure.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Name on the command line.
    pub name: String,
    /// Caption.
    pub title: String,
    /// Seed of its draws; experiments with the same seed share cells.
    pub seed: String,
    /// Models compared.
    pub models: Vec<ModelKind>,
    /// Scope of each profile.
    pub profile: BTreeMap<Profile, Scope>,
    /// Expectation of the published rows, where there is one.
    pub expect: Option<Expectation>,
    /// Prose.
    pub text: Prose,
}

/// Prose of an experiment.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Prose {
    /// How to read the result.
    pub analysis: String,
}

/// What to compute instead of what the profile says, for development.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selection {
    /// Joints.
    pub joints: Option<Vec<usize>>,
    /// Loads, with one context.
    pub loads: Option<Vec<usize>>,
    /// Sizes, with one context.
    pub sizes: Option<Vec<usize>>,
    /// Sizes, with many contexts.
    pub totals: Option<Vec<usize>>,
    /// Ranks.
    pub ranks: Option<Vec<usize>>,
    /// Draws of the subsets beyond the first, with many contexts.
    pub n_more_repeats: usize,
}

impl Experiment {
    /// Every experiment there is, in the order of the chapter.
    ///
    /// # Errors
    /// `Experiment` if a description does not follow the format.
    pub fn all() -> Result<Vec<Self>, BenchError> {
        SOURCES
            .iter()
            .map(|(name, source)| Self::parse(name, source))
            .collect()
    }

    /// Reads one description.
    ///
    /// # Errors
    /// `Experiment` if it is not TOML of this format, or names a load, joint or size that does not exist.
    pub fn parse(name: &str, source: &str) -> Result<Self, BenchError> {
        let experiment: Self = experiment_file::parse(name, source)?;
        for (profile, scope) in &experiment.profile {
            scope.validate().map_err(|message| {
                BenchError::experiment(name, format!("profile {}: {message}", profile.name()))
            })?;
        }
        Ok(experiment)
    }

    /// The experiment with other draws: experiments that share a seed still do.
    #[must_use]
    pub fn reseeded(self, seed: &str) -> Self {
        Self {
            seed: format!("{seed}/{}", self.seed),
            ..self
        }
    }

    /// Scope under a profile and a selection.
    ///
    /// # Errors
    /// `Experiment` if the profile is missing.
    pub fn scope(&self, profile: Profile, selection: &Selection) -> Result<Scope, BenchError> {
        let scope = of_profile(&self.name, &self.profile, profile)?;
        let chosen =
            |own: &Vec<usize>, other: &Option<Vec<usize>>| other.as_ref().unwrap_or(own).clone();
        Ok(Scope {
            loads: chosen(&scope.loads, &selection.loads),
            joints: chosen(&scope.joints, &selection.joints),
            sizes: chosen(&scope.sizes, &selection.sizes),
        })
    }

    /// Cells of a scope.
    pub fn cells(&self, scope: &Scope) -> BTreeSet<Cell> {
        let mut cells = BTreeSet::new();
        for &load in &scope.loads {
            for &joint in &scope.joints {
                for &model in &self.models {
                    cells.extend(scope.sizes.iter().map(|&n| Cell {
                        seed: self.seed.clone(),
                        load,
                        joint,
                        model,
                        n,
                    }));
                }
            }
        }
        cells
    }
}

impl Scope {
    fn validate(&self) -> Result<(), String> {
        check("load", &self.loads, UNIQUE.len())?;
        check("joint", &self.joints, N_JOINTS)?;
        check("size", &self.sizes, MAX_SIZE)
    }
}

/// What an experiment has of a profile.
///
/// # Errors
/// `Experiment` if the profile is missing.
pub(crate) fn of_profile<'a, S>(
    experiment: &str,
    profiles: &'a BTreeMap<Profile, S>,
    profile: Profile,
) -> Result<&'a S, BenchError> {
    let missing = || format!("profile {} is missing", profile.name());
    let scope = profiles.get(&profile);
    scope.ok_or_else(|| BenchError::experiment(experiment, missing()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(name: &str) -> Experiment {
        let mut all = Experiment::all().unwrap().into_iter();
        all.find(|experiment| experiment.name == name).unwrap()
    }

    #[test]
    fn smoke_is_the_published_subset() {
        let all = Experiment::all().unwrap();
        let cells: BTreeSet<Cell> = all
            .iter()
            .flat_map(|e| e.cells(&e.scope(Profile::Smoke, &Selection::default()).unwrap()))
            .collect();
        // 15 loads × 3 joints × 2 sizes, 4 models of the chapter and 3 of ours; table 3's cells are among those of fig. 7.
        let (ours, chapters): (Vec<Cell>, Vec<Cell>) =
            (cells.into_iter()).partition(|cell| cell.model.rigid_body().is_some());
        assert_eq!((chapters.len(), ours.len()), (360, 270));
    }

    #[test]
    fn full_is_everything_in_fig_7() {
        let fig07 = named("fig07");
        let scope = fig07.scope(Profile::Full, &Selection::default()).unwrap();
        assert_eq!(fig07.cells(&scope).len(), 15 * 6 * 6 * 4);
    }

    #[test]
    fn a_selection_replaces_the_profiles_lists() {
        let table3 = named("table3");
        let selection = Selection {
            loads: Some(vec![2]),
            joints: Some(vec![5]),
            sizes: Some(vec![40]),
            ..Selection::default()
        };
        let scope = table3.scope(Profile::Smoke, &selection).unwrap();
        assert_eq!(
            (scope.loads, scope.joints, scope.sizes),
            (vec![2], vec![5], vec![40])
        );
    }

    #[test]
    fn unknown_numbers_are_refused() {
        let source = include_str!("../experiments/table3.toml").replace("[1, 3, 6]", "[1, 7]");
        let error = Experiment::parse("x", &source).unwrap_err().to_string();
        assert!(error.contains("joint 7 is not in 1 to 6"), "{error}");
    }
}
