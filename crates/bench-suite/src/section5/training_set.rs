//! Which samples the shared models are trained on.

use faer::Mat;
use mtgp::Stacked;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::multi::draw::nested;
use crate::section_experiment::SectionExperiment;
use crate::seed::{sample_indices, stream};
use crate::spec::Profile;
use crate::split::{N_PATHS, N_SPEEDS, REFERENCE, Split, TrajectoryId, UNIQUE};

/// Seed of the subsets, that of figures 10 and 11.
const SEED: &str = "many-contexts";
/// Seed of the training and test sets, that of table 3.
pub const SPLIT_SEED: &str = "one-context";

/// What the settings of an experiment say of its training set, among others.
#[derive(Deserialize)]
struct SetSettings {
    n_total: Option<usize>,
    #[serde(default, deserialize_with = "trajectories")]
    held_out: Vec<TrajectoryId>,
}

/// Samples of the loads c1 to c`n_contexts`, equally many of each.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TrainingSet {
    /// Loads.
    pub n_contexts: usize,
    /// Samples of all loads together; a multiple of their number.
    pub n_total: usize,
    /// Trajectories without a sample, whole; empty for the training sets of section 4.6.
    pub held_out: Vec<TrajectoryId>,
}

impl TrainingSet {
    /// The 14 loads of section 4.6, from the trajectories of table 2.
    pub fn of_table_2(n_total: usize) -> Self {
        Self {
            n_contexts: 14,
            n_total,
            held_out: Vec::new(),
        }
    }

    /// What the models of an experiment are trained on in a profile; `None` if it uses none of the shared ones.
    ///
    /// # Errors
    /// `Experiment` if there is no such profile, or a trajectory held out does not exist.
    pub fn of_experiment(
        experiment: &SectionExperiment,
        profile: Profile,
    ) -> Result<Option<Self>, BenchError> {
        let settings: SetSettings = experiment.settings(profile)?;
        let of_size = |n_total| Self::holding_out(n_total, settings.held_out);
        Ok(settings.n_total.map(of_size))
    }

    /// The same loads without a sample of some trajectories.
    pub fn holding_out(n_total: usize, held_out: Vec<TrajectoryId>) -> Self {
        Self {
            held_out,
            ..Self::of_table_2(n_total)
        }
    }

    /// Samples of each load.
    pub fn n_each(&self) -> usize {
        self.n_total / self.n_contexts
    }

    /// Training rows of load c`load`, from 1.
    ///
    /// With nothing held out they are those of section 4.6 at the same size.
    /// Else they are drawn from T_r and the load's own trajectory together; a load whose own
    /// trajectory is held out takes that of the load before it, or the one before that.
    ///
    /// # Panics
    /// If there is no such load, or T_r or every trajectory up to the load's is held out.
    /// # Source
    /// Table 2; sections 2.3 and 4.6.
    pub fn rows(&self, load: usize) -> Vec<usize> {
        if self.held_out.is_empty() {
            let split = Split::draw(SPLIT_SEED, load);
            return nested(&split, SEED, load, 0, self.n_each());
        }
        assert!(!self.held_out.contains(&REFERENCE), "T_r is held out");
        let own = (0..load)
            .rev()
            .find(|&i| !self.held_out.contains(&UNIQUE[i]));
        let own = UNIQUE[own.expect("a trajectory up to the load's")];
        let pool: Vec<usize> = REFERENCE.rows().chain(own.rows()).collect();
        let mut rng = stream(SEED, &format!("held-out/c{load}"));
        let drawn = sample_indices(&mut rng, pool.len(), self.n_each());
        drawn.into_iter().map(|i| pool[i]).collect()
    }

    /// What a model file's key says of it.
    pub fn key(&self) -> String {
        let held_out: Vec<String> = (self.held_out.iter()).map(ToString::to_string).collect();
        format!(
            "seed {SEED}; split seed {SPLIT_SEED}; contexts {}; n {}; held out {}",
            self.n_contexts,
            self.n_total,
            held_out.join(" ")
        )
    }

    /// The samples, those of each load together.
    ///
    /// # Errors
    /// `MultiTask` if they do not fit together.
    pub fn samples(&self, data: &DataSet) -> Result<Samples, BenchError> {
        let loads: Vec<usize> = (1..=self.n_contexts).collect();
        let rows = loads.iter().map(|&load| self.rows(load)).collect();
        Samples::of(data, loads, rows)
    }
}

/// Reads the trajectory that an experiment names: (p1,s2) is written p1s2.
///
/// # Errors
/// A sentence if there is none of that name.
pub fn trajectory<'de, D: Deserializer<'de>>(names: D) -> Result<TrajectoryId, D::Error> {
    named(&String::deserialize(names)?).map_err(D::Error::custom)
}

/// The same for several.
///
/// # Errors
/// A sentence if one does not exist.
pub fn trajectories<'de, D: Deserializer<'de>>(names: D) -> Result<Vec<TrajectoryId>, D::Error> {
    let names = Vec::<String>::deserialize(names)?;
    let read: Result<_, _> = names.iter().map(|name| named(name)).collect();
    read.map_err(D::Error::custom)
}

fn named(name: &str) -> Result<TrajectoryId, String> {
    let found = TrajectoryId::all().find(|id| id.to_string() == name);
    found.ok_or_else(|| format!("\"{name}\" is not a trajectory p1s1 to p{N_PATHS}s{N_SPEEDS}"))
}

/// The samples of a training set.
pub struct Samples {
    /// The load of each task, from 1.
    pub loads: Vec<usize>,
    /// Rows of the data set, of each load.
    pub rows: Vec<Vec<usize>>,
    /// Inputs, (n, 18), those of each load together.
    pub x: Mat<f64>,
    /// Inputs with their tasks.
    pub stacked: Stacked,
}

impl Samples {
    /// Given rows of some loads, which become the tasks 0, 1, ….
    ///
    /// # Errors
    /// `MultiTask` if a load has no rows.
    pub fn of(
        data: &DataSet,
        loads: Vec<usize>,
        rows: Vec<Vec<usize>>,
    ) -> Result<Self, BenchError> {
        let counted = rows.iter().enumerate();
        let tasks: Vec<usize> = counted
            .flat_map(|(task, rows)| std::iter::repeat_n(task, rows.len()))
            .collect();
        let x = data.x(&rows.concat());
        Ok(Self {
            stacked: Stacked::new(x.as_ref(), &tasks, loads.len())?,
            loads,
            rows,
            x,
        })
    }

    /// Torques of a joint, from 1, in the order of `stacked`, N·m.
    pub fn targets(&self, data: &DataSet, joint: usize) -> Vec<f64> {
        let of_loads = self.loads.iter().zip(&self.rows);
        let targets: Vec<f64> = of_loads
            .flat_map(|(&load, rows)| data.torques(load, joint, rows))
            .collect();
        self.stacked.stack(&targets)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_of_held_out_trajectories_are_not_trained_on() {
        let held_out = vec![UNIQUE[4], UNIQUE[6], UNIQUE[10]];
        let set = TrainingSet {
            held_out: held_out.clone(),
            ..TrainingSet::of_table_2(1820)
        };
        for load in 1..=14 {
            let rows = set.rows(load);
            assert_eq!(rows.len(), 130);
            assert!(
                held_out
                    .iter()
                    .all(|id| rows.iter().all(|row| !id.rows().contains(row))),
                "c{load}"
            );
        }
        // c5 has lost its own trajectory and takes that of c4.
        let of_c4 = |row: &usize| UNIQUE[3].rows().contains(row);
        assert!(set.rows(5).iter().any(of_c4));
    }

    #[test]
    fn trajectories_are_read_and_wrong_ones_refused() {
        assert_eq!(named("p2s3"), Ok(REFERENCE));
        for wrong in ["p5s1", "p1s0", "s1p1", "p1", ""] {
            let message = named(wrong).unwrap_err();
            assert!(
                message.ends_with("is not a trajectory p1s1 to p4s4"),
                "{message}"
            );
        }
    }

    #[test]
    fn with_nothing_held_out_the_rows_are_those_of_section_4() {
        let set = TrainingSet::of_table_2(280);
        let split = Split::draw("one-context", 3);
        assert_eq!(set.rows(3), nested(&split, "many-contexts", 3, 0, 20));
    }
}
