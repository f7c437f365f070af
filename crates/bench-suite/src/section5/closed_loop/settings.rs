//! What the experiment's TOML says.

use serde::Deserialize;

use crate::section5::training_set::{TrainingSet, trajectories, trajectory};
use crate::split::TrajectoryId;

/// Settings of a profile.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Training samples of a joint, of all loads together.
    pub n_total: usize,
    /// Trajectories not trained on, whole.
    #[serde(deserialize_with = "trajectories")]
    pub held_out: Vec<TrajectoryId>,
    /// Known loads that the arm carries, from 1.
    pub loads: Vec<usize>,
    /// Samples of c15 that the models adapt to.
    pub new_samples: usize,
    /// Trajectories that the arm follows.
    #[serde(deserialize_with = "trajectories")]
    pub followed: Vec<TrajectoryId>,
    /// Bandwidths of the gains, rad/s, ascending.
    pub bandwidths: Vec<f64>,
    /// Damping ratio of the gains.
    pub damping_ratio: f64,
    /// Steps of the integration from one tick to the next.
    pub n_steps: usize,
    /// The obstacle.
    pub wall: Obstacle,
    /// The change of load.
    pub switch: Switch,
}

/// A wall in the way of a trajectory.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Obstacle {
    /// Trajectory that leads into it.
    #[serde(deserialize_with = "trajectory")]
    pub trajectory: TrajectoryId,
    /// Load that the arm carries, from 1.
    pub load: usize,
    /// Distance from the path's centre, as a part of the path's half width.
    pub share: f64,
    /// N/m.
    pub stiffness: f64,
    /// s/m.
    pub dissipation: f64,
}

/// A load changed for another half-way.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Switch {
    /// Trajectory that the arm follows.
    #[serde(deserialize_with = "trajectory")]
    pub trajectory: TrajectoryId,
    /// Loads before and after, from 1.
    pub pairs: Vec<(usize, usize)>,
    /// Bandwidth of the gains, rad/s.
    pub bandwidth: f64,
    /// Changes per second that the tracker expects.
    pub rate: f64,
    /// Samples that the tracker takes together.
    pub window: usize,
    /// Part of the torques that the tracker takes for outliers.
    pub outlier_probability: f64,
    /// Their standard deviation in those that the model says.
    pub outlier_spread: f64,
}

impl Settings {
    /// What the models are trained on.
    pub fn training_set(&self) -> TrainingSet {
        TrainingSet::holding_out(self.n_total, self.held_out.clone())
    }
}

#[cfg(test)]
impl Obstacle {
    /// Half-way to the side.
    pub fn sample() -> Self {
        Self {
            trajectory: crate::split::UNIQUE[4], // (p2,s4)
            load: 3,
            share: 0.5,
            stiffness: 1e4,
            dissipation: 1.0,
        }
    }
}
