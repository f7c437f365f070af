//! Experiments with many contexts as data: figures 10 and 11.

use std::collections::{BTreeMap, BTreeSet};

use serde::Deserialize;

use super::model::MultiModel;
use super::shared::SharedScope;
use super::unit::Unit;
use crate::cell::TestSet;
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::experiment_file::{self, check, experiment_files};
use crate::rigid_body::Terms;
use crate::spec::{MAX_SIZE, Profile, Prose, Selection, of_profile};
use crate::split::UNIQUE;

/// Sources of the experiments.
const SOURCES: [(&str, &str); 2] = experiment_files!["fig10.toml", "fig11.toml"];

/// Joints, sizes and ranks of a run.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiScope {
    /// Joints 1..6.
    pub joints: Vec<usize>,
    /// Training samples of all contexts together; multiples of the number of contexts.
    pub totals: Vec<usize>,
    /// Ranks among which mGP-BIC chooses.
    pub ranks: Vec<usize>,
    /// Where one K^ρ for all joints is learned, too.
    pub shared: Option<SharedScope>,
    /// Training samples of all contexts together up to which the models with the prior of section 3.2
    /// are learned, too.
    pub rigid_body_up_to: Option<usize>,
    /// More samples than the chapter's figures show.
    pub beyond: Option<BeyondScope>,
}

/// Joints, sizes and ranks of the columns that stand apart from the chapter's.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BeyondScope {
    /// Joints 1..6.
    pub joints: Vec<usize>,
    /// Training samples of all contexts together.
    pub totals: Vec<usize>,
    /// Ranks among which mGP-BIC chooses.
    pub ranks: Vec<usize>,
}

/// What is expected of mGP-BIC.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiExpectation {
    /// In how many of all panels and sizes it has the lowest average, if the profile is full.
    pub lowest_at_least: usize,
}

/// One figure.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiExperiment {
    /// Name on the command line.
    pub name: String,
    /// Caption.
    pub title: String,
    /// Seed of the training subsets.
    pub seed: String,
    /// Seed of the training and test sets; that of table 3, so that both have the same ones.
    pub split_seed: String,
    /// Contexts c1..c`n_contexts`.
    pub n_contexts: usize,
    /// Test set that the figure shows.
    pub set: TestSet,
    /// Scope of each profile.
    pub profile: BTreeMap<Profile, MultiScope>,
    /// Expectation of the counts.
    pub expect: MultiExpectation,
    /// Prose.
    pub text: Prose,
}

impl MultiExperiment {
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
    /// `Experiment` if it is not TOML of this format, or names a joint, size or rank that does not fit.
    pub fn parse(name: &str, source: &str) -> Result<Self, BenchError> {
        let experiment: Self = experiment_file::parse(name, source)?;
        for (profile, scope) in &experiment.profile {
            experiment.validate(scope).map_err(|message| {
                BenchError::experiment(name, format!("profile {}: {message}", profile.name()))
            })?;
        }
        Ok(experiment)
    }

    /// The experiment with other draws, whose training and test sets are still those of table 3.
    #[must_use]
    pub fn reseeded(self, seed: &str) -> Self {
        Self {
            seed: format!("{seed}/{}", self.seed),
            split_seed: format!("{seed}/{}", self.split_seed),
            ..self
        }
    }

    /// Scope under a profile and a selection.
    ///
    /// # Errors
    /// `Experiment` if the profile is missing, or a size cannot be shared out among the contexts.
    pub fn scope(&self, profile: Profile, selection: &Selection) -> Result<MultiScope, BenchError> {
        let mut scope = of_profile(&self.name, &self.profile, profile)?.clone();
        let replace = |own: &mut Vec<usize>, other: &Option<Vec<usize>>| {
            if let Some(other) = other {
                own.clone_from(other);
                own.sort_unstable();
                own.dedup();
            }
        };
        replace(&mut scope.joints, &selection.joints);
        replace(&mut scope.totals, &selection.totals);
        replace(&mut scope.ranks, &selection.ranks);
        if selection.totals.is_some() || selection.ranks.is_some() {
            scope.beyond = None;
        }
        if let (Some(joints), Some(beyond)) = (&selection.joints, &mut scope.beyond) {
            beyond.joints.retain(|joint| joints.contains(joint));
        }
        if let (Some(ranks), Some(shared)) = (&selection.ranks, &mut scope.shared) {
            shared.ranks.retain(|rank| ranks.contains(rank));
        }
        self.validate(&scope)
            .map_err(|message| BenchError::experiment(&self.name, message))?;
        Ok(scope)
    }

    /// Units of a scope, for each repeat.
    pub fn units(&self, scope: &MultiScope, n_repeats: usize) -> BTreeSet<Unit> {
        let mut units = BTreeSet::new();
        for repeat in 0..n_repeats {
            let chapters = chapters_models(&scope.ranks);
            units.extend(self.grid(repeat, &scope.joints, &scope.totals, &chapters));
            if let Some(most) = scope.rigid_body_up_to {
                let totals: Vec<usize> = scope
                    .totals
                    .iter()
                    .copied()
                    .filter(|n| *n <= most)
                    .collect();
                let models = [MultiModel::RigidBodyAndProcess];
                units.extend(self.grid(repeat, &scope.joints, &totals, &models));
                // Units of their own: those of the others are kept as they were.
                let shared = Terms::ALL.map(MultiModel::Shared);
                units.extend(self.grid(repeat, &scope.joints, &totals, &shared));
            }
            if let Some(beyond) = &scope.beyond {
                let models = chapters_models(&beyond.ranks);
                units.extend(self.grid(repeat, &beyond.joints, &beyond.totals, &models));
            }
        }
        units
    }

    /// Units of every joint at every size, with the same models.
    fn grid(
        &self,
        repeat: usize,
        joints: &[usize],
        totals: &[usize],
        models: &[MultiModel],
    ) -> Vec<Unit> {
        let unit = |joint, n_total| Unit {
            seed: self.seed.clone(),
            split_seed: self.split_seed.clone(),
            repeat,
            joint,
            n_contexts: self.n_contexts,
            n_total,
            models: models.to_vec(),
        };
        let of_joint = |&joint: &usize| totals.iter().map(move |&n_total| (joint, n_total));
        let pairs = joints.iter().flat_map(of_joint);
        pairs.map(|(joint, n_total)| unit(joint, n_total)).collect()
    }

    fn validate(&self, scope: &MultiScope) -> Result<(), String> {
        let m = self.n_contexts;
        if !(2..=UNIQUE.len()).contains(&m) {
            return Err(format!("{m} contexts are not 2 to {}", UNIQUE.len()));
        }
        let beyond = scope.beyond.as_ref();
        let with = |own: &[usize], beyond: Option<&Vec<usize>>| -> Vec<usize> {
            own.iter()
                .chain(beyond.into_iter().flatten())
                .copied()
                .collect()
        };
        let joints = with(&scope.joints, beyond.map(|beyond| &beyond.joints));
        let totals = with(&scope.totals, beyond.map(|beyond| &beyond.totals));
        let ranks = with(&scope.ranks, beyond.map(|beyond| &beyond.ranks));
        check("joint", &joints, N_JOINTS)?;
        let fits = |n: usize| n.is_multiple_of(m) && (2 * m..=m * MAX_SIZE).contains(&n);
        if let Some(n) = totals.into_iter().find(|&n| !fits(n)) {
            return Err(format!(
                "n = {n} is not a multiple of the {m} contexts with 2 to {MAX_SIZE} samples each"
            ));
        }
        check("rank", &ranks, m)?;
        let shared = scope.shared.iter().flat_map(|shared| &shared.ranks);
        match shared.into_iter().find(|rank| !scope.ranks.contains(rank)) {
            Some(rank) => Err(format!(
                "rank {rank} has no fits of its own to set out from"
            )),
            None => Ok(()),
        }
    }
}

/// Models of section 4.6, with an mGP of each rank.
fn chapters_models(ranks: &[usize]) -> Vec<MultiModel> {
    let learned_alone = [
        MultiModel::Single,
        MultiModel::Independent,
        MultiModel::Pooled,
    ];
    let of_rank = ranks.iter().map(|&rank| MultiModel::Transfer { rank });
    learned_alone.into_iter().chain(of_rank).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_figures_share_their_units() {
        let all = MultiExperiment::all().unwrap();
        let units: BTreeSet<Unit> = all
            .iter()
            .flat_map(|e| {
                let scope = e.scope(Profile::Full, &Selection::default());
                e.units(&scope.unwrap(), 1)
            })
            .collect();
        let (others, chapters): (Vec<Unit>, Vec<Unit>) =
            units.into_iter().partition(Unit::is_rigid_body);
        let (chapters, beyond): (Vec<&Unit>, Vec<&Unit>) =
            chapters.iter().partition(|unit| unit.n_total <= 1820);
        assert_eq!((others.len(), chapters.len()), (96, 48));
        assert!(chapters.iter().all(|unit| unit.models.len() == 9));
        let beyond: Vec<(usize, usize)> = beyond.iter().map(|u| (u.joint, u.n_total)).collect();
        assert_eq!(beyond, [(3, 56_000)]);
        assert_eq!([all[0].set, all[1].set], TestSet::ALL);
    }

    #[test]
    fn sizes_that_cannot_be_shared_out_are_refused() {
        let fig10 = &MultiExperiment::all().unwrap()[0];
        for (n, message) in [
            (281, "n = 281 is not"),
            (14, "n = 14 is not"),
            (56_014, "n = 56014"),
        ] {
            let selection = Selection {
                totals: Some(vec![n]),
                ..Selection::default()
            };
            let error = fig10.scope(Profile::Smoke, &selection).unwrap_err();
            assert!(error.to_string().contains(message), "{error}");
        }
    }

    #[test]
    fn a_selection_of_sizes_or_ranks_leaves_out_what_stands_apart() {
        let fig10 = &MultiExperiment::all().unwrap()[0];
        let beyond = |selection: &Selection| {
            let scope = fig10.scope(Profile::Full, selection).unwrap();
            let units = fig10.units(&scope, 1);
            units.iter().filter(|unit| unit.n_total == 56_000).count()
        };
        let joints = |joints: &[usize]| Selection {
            joints: Some(joints.to_vec()),
            ..Selection::default()
        };
        assert_eq!(beyond(&joints(&[1, 3])), 1);
        assert_eq!(beyond(&joints(&[1, 2])), 0);
        let totals = Selection {
            totals: Some(vec![280]),
            ..Selection::default()
        };
        assert_eq!(beyond(&totals), 0);
        let ranks = Selection {
            ranks: Some(vec![2]),
            ..Selection::default()
        };
        assert_eq!(beyond(&ranks), 0);
    }

    #[test]
    fn a_rank_above_the_number_of_contexts_is_refused() {
        let source = include_str!("../../experiments/fig10.toml").replace("8, 10]", "8, 15]");
        let error = MultiExperiment::parse("x", &source)
            .unwrap_err()
            .to_string();
        assert!(error.contains("rank 15 is not in 1 to 14"), "{error}");
    }
}
