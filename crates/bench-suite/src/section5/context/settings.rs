//! What the experiment's TOML says.

use serde::Deserialize;

use super::super::training_set::{TrainingSet, trajectories};
use crate::split::TrajectoryId;

/// Settings of a profile.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Training samples of a joint.
    pub n_total: usize,
    /// Trajectories not trained on.
    #[serde(deserialize_with = "trajectories")]
    pub held_out: Vec<TrajectoryId>,
    /// Trajectories that the trials are on.
    #[serde(deserialize_with = "trajectories")]
    pub tested: Vec<TrajectoryId>,
    /// Places on each of them where trials begin.
    pub places: usize,
    /// Numbers of samples, ascending.
    pub counts: Vec<usize>,
    /// Standard deviations, N·m.
    pub torque_noise: Vec<f64>,
    /// Of false alarms.
    pub level: f64,
    /// Samples that the tracker takes together.
    pub windows: Vec<usize>,
    /// Changes of load per second.
    pub switching_rate: f64,
    /// Standard deviation, N·m.
    pub switch_noise: f64,
    /// Places of a change on each trajectory.
    pub switch_places: usize,
}

impl Settings {
    /// Samples of the longest trial.
    pub fn most(&self) -> usize {
        self.counts.iter().copied().max().unwrap_or(0)
    }

    /// What the models are trained on.
    pub fn training_set(&self) -> TrainingSet {
        TrainingSet::holding_out(self.n_total, self.held_out.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section_experiment::{Kind, SectionExperiment};
    use crate::spec::Profile;

    #[test]
    fn trials_are_on_trajectories_without_a_training_sample() {
        let all = SectionExperiment::all(Kind::Section5).unwrap();
        let experiment = all.iter().find(|one| one.name == "context").unwrap();
        for profile in [Profile::Smoke, Profile::Full] {
            let settings: Settings = experiment.settings(profile).unwrap();
            let set = settings.training_set();
            for trajectory in settings.tested {
                let rows = trajectory.rows();
                let is_trained = |load| set.rows(load).iter().any(|row| rows.contains(row));
                assert!(!(1..=14).any(is_trained), "{trajectory:?}");
            }
        }
    }
}
