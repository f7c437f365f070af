//! The rank of mGP-BIC: one for all joints of a size, by eq. (19).

use std::collections::{BTreeMap, BTreeSet};

use mtgp::fit::{RankCandidate, RankCounts};
use mtgp::{Criterion, choose_rank};

use super::model::MultiModel;
use super::unit::{ModelRecord, UnitRecord};
use crate::error::BenchError;

/// The choice at one size and repeat.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// Joints whose likelihoods entered.
    pub joints: Vec<usize>,
    /// (rank, BIC), ascending in the rank.
    pub bic: Vec<(usize, f64)>,
    /// Rank of the least BIC.
    pub rank: usize,
}

/// All choices of a run, by repeat and size.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Choices(pub BTreeMap<(usize, usize), Choice>);

impl Choices {
    /// Chooses from the likelihoods that the units recorded.
    ///
    /// Only ranks that every joint of a size has a result for take part.
    ///
    /// # Errors
    /// `MultiTask` if a recorded likelihood is not finite.
    pub fn of(records: &[UnitRecord]) -> Result<Self, BenchError> {
        let mut groups: BTreeMap<(usize, usize), Vec<&UnitRecord>> = BTreeMap::new();
        for record in records.iter().filter(|r| !r.unit.is_rigid_body()) {
            let unit = &record.unit;
            let key = (unit.repeat, unit.n_total);
            groups.entry(key).or_default().push(record);
        }
        let mut choices = BTreeMap::new();
        for (key, group) in groups {
            let candidates = candidates(&group);
            if !candidates.is_empty() {
                choices.insert(key, choose(&group, &candidates)?);
            }
        }
        Ok(Self(choices))
    }

    /// The rank at a repeat and a size.
    pub fn rank(&self, repeat: usize, n_total: usize) -> Option<usize> {
        self.0.get(&(repeat, n_total)).map(|choice| choice.rank)
    }

    /// The result of mGP-BIC for a unit.
    pub fn chosen<'a>(&self, record: &'a UnitRecord) -> Option<&'a ModelRecord> {
        let rank = self.rank(record.unit.repeat, record.unit.n_total)?;
        record.of(MultiModel::Transfer { rank })
    }
}

/// The ranks that all units of a group have, each with its likelihoods in the order of the group.
fn candidates(group: &[&UnitRecord]) -> Vec<RankCandidate> {
    let ranks = |record: &UnitRecord| -> BTreeSet<usize> {
        let models = record.models.iter();
        models.filter_map(|m| m.model.rank()).collect()
    };
    let shared = group
        .iter()
        .map(|record| ranks(record))
        .reduce(|a, b| a.intersection(&b).copied().collect());
    let log_marginals = |rank| {
        let of_rank = group.iter();
        let of_rank = of_rank.filter_map(|record| record.of(MultiModel::Transfer { rank }));
        of_rank.filter_map(|m| m.log_marginal_likelihood).collect()
    };
    let candidate = |rank| RankCandidate {
        rank,
        log_marginals: log_marginals(rank),
    };
    shared
        .unwrap_or_default()
        .into_iter()
        .map(candidate)
        .collect()
}

fn choose(group: &[&UnitRecord], candidates: &[RankCandidate]) -> Result<Choice, BenchError> {
    let counts = RankCounts {
        n_tasks: group
            .iter()
            .map(|record| record.unit.n_contexts)
            .max()
            .unwrap_or(0),
        n_input_params: group.iter().map(|record| n_input_params(record)).collect(),
        n_observations: group.iter().map(|record| record.unit.n_total).collect(),
    };
    let choice = choose_rank(candidates, &counts, Criterion::Bic)?;
    let mut joints: Vec<usize> = group.iter().map(|record| record.unit.joint).collect();
    joints.sort_unstable();
    Ok(Choice {
        joints,
        bic: choice.values,
        rank: choice.rank,
    })
}

/// d_i: the hyperparameters of c^x without σ, the same for every rank.
fn n_input_params(record: &UnitRecord) -> usize {
    let fits = record.models.iter().filter(|m| m.model.rank().is_some());
    let mut fits = fits.flat_map(|m| &m.fits);
    fits.next().map_or(0, |fit| fit.hyperparameters.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multi::unit::tests::{unit, unit_record};

    #[test]
    fn joints_choose_together_and_a_rank_must_pay_for_its_entries() {
        let record = |joint, log_2: f64, log_4: f64| {
            let values = [0.0, 0.0, 0.0, log_2, log_4].map(|log| (log, 1.0));
            unit_record(unit(joint, 280), &values)
        };
        // Rank 2 has 27 entries a joint and rank 4 has 50: 46 more for two joints, each worth ½ ln 560 = 3.16 nats.
        let poor = [record(1, 0.0, 72.0), record(3, 0.0, 73.0)];
        assert_eq!(Choices::of(&poor).unwrap().rank(0, 280), Some(2));
        let rich = [record(1, 0.0, 73.0), record(3, 0.0, 73.0)];
        let choices = Choices::of(&rich).unwrap();
        assert_eq!(choices.rank(0, 280), Some(4));
        assert_eq!(choices.0[&(0, 280)].joints, [1, 3]);
        assert_eq!(choices.rank(0, 281), None);
    }
}
