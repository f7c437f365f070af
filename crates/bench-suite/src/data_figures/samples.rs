//! The samples of section 2: states of all trajectories, torques under a load, and the Coulomb part of them.

use puma_dyn::Scenario;
use puma_dyn::chapter::Trajectory;
use puma_dyn::dynamics::coulomb_torques;

use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::split::{N_SAMPLES, TrajectoryId};

/// Number of covariates: q, q̇ and q̈ of every joint.
pub const N_COVARIATES: usize = 3 * N_JOINTS;

/// The reference scenario and its sixteen trajectories.
pub struct Samples {
    scenario: Scenario,
    /// In the order of [`TrajectoryId::all`].
    trajectories: Vec<Trajectory>,
}

impl Samples {
    /// Simulates the trajectories of the reference scenario.
    ///
    /// # Errors
    /// `Dynamics` if a point cannot be reached; `Malformed` if a trajectory has not 4000 samples.
    pub fn reference() -> Result<Self, BenchError> {
        let scenario = Scenario::reference();
        let trajectories = scenario.trajectories()?;
        let n_samples = scenario.n_samples();
        if n_samples != N_SAMPLES {
            let message = format!("{n_samples} samples a trajectory, not {N_SAMPLES}");
            return Err(BenchError::malformed("fixtures/scenario.toml", message));
        }
        Ok(Self {
            scenario,
            trajectories,
        })
    }

    /// The scenario behind the samples.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// One trajectory.
    pub fn trajectory(&self, id: TrajectoryId) -> &Trajectory {
        &self.trajectories[id.rows().start / N_SAMPLES]
    }

    /// All states, 16 × 4000 slices of 18 numbers: q rad, q̇ rad/s, q̈ rad/s².
    pub fn states(&self) -> impl Iterator<Item = &[f64]> + Clone {
        let of_one = |trajectory: &'_ Trajectory| trajectory.states.len();
        debug_assert!(
            self.trajectories
                .iter()
                .all(|t| of_one(t) == N_SAMPLES * N_COVARIATES)
        );
        self.trajectories
            .iter()
            .flat_map(|trajectory| trajectory.states.chunks_exact(N_COVARIATES))
    }

    /// States of one trajectory, 4000 slices of 18 numbers.
    pub fn states_of(&self, id: TrajectoryId) -> impl Iterator<Item = &[f64]> {
        self.trajectory(id).states.chunks_exact(N_COVARIATES)
    }

    /// Torque of a joint (from 1) along a trajectory under a load (from 1), N·m.
    ///
    /// # Errors
    /// `Dynamics` if there is no such load.
    ///
    /// # Panics
    /// If there is no such joint.
    pub fn torques(
        &self,
        id: TrajectoryId,
        load: usize,
        joint: usize,
    ) -> Result<Vec<f64>, BenchError> {
        assert!((1..=N_JOINTS).contains(&joint), "joint {joint}");
        let load_idx = self.scenario.load_idx(&format!("c{load}"))?;
        let torques = self.scenario.torques(self.trajectory(id), load_idx);
        let rows = torques.chunks_exact(N_JOINTS);
        Ok(rows.map(|row| row[joint - 1]).collect())
    }

    /// Coulomb torque of a joint (from 1) along a trajectory, N·m: the same under every load.
    ///
    /// # Panics
    /// If there is no such joint.
    pub fn coulomb(&self, id: TrajectoryId, joint: usize) -> Vec<f64> {
        assert!((1..=N_JOINTS).contains(&joint), "joint {joint}");
        let trajectory = self.trajectory(id);
        let friction = self.scenario.effects().friction;
        let mut tau = [0.0; N_JOINTS];
        let at = |sample_idx| {
            let (_, qd, _) = trajectory.state(sample_idx);
            coulomb_torques(self.scenario.model(), friction, qd, &mut tau);
            tau[joint - 1]
        };
        (0..N_SAMPLES).map(at).collect()
    }
}

/// Phase of each sample of a trajectory over π, from 0 to just below 2.
///
/// ```text
/// φ_k / π = 2 k / 4000
/// ```
pub fn phases_over_pi() -> Vec<f64> {
    let phase = |k| 2.0 * k as f64 / N_SAMPLES as f64;
    (0..N_SAMPLES).map(phase).collect()
}

/// (p`path`, s`speed`) as the chapter writes it.
pub fn label(id: TrajectoryId) -> String {
    format!("(p{},s{})", id.path_idx + 1, id.speed_idx + 1)
}

/// The trajectories that the figures show.
pub mod shown {
    use crate::split::TrajectoryId;

    /// (p1, s1)
    pub const NEAR_SLOW: TrajectoryId = TrajectoryId {
        path_idx: 0,
        speed_idx: 0,
    };
    /// (p1, s4)
    pub const NEAR_FAST: TrajectoryId = TrajectoryId {
        path_idx: 0,
        speed_idx: 3,
    };
    /// (p4, s1)
    pub const FAR_SLOW: TrajectoryId = TrajectoryId {
        path_idx: 3,
        speed_idx: 0,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_phase_axis_is_the_fraction_of_the_round() {
        let samples = Samples::reference().unwrap();
        let phases = phases_over_pi();
        assert_eq!(phases.len(), N_SAMPLES);
        let trajectory = samples.trajectory(shown::NEAR_FAST);
        for (phase, time) in phases.iter().zip(&trajectory.time) {
            // φ/π = 2 t / T with T = 5 s: three roundings.
            let expected = 2.0 * time / 5.0;
            assert!(
                (phase - expected).abs() <= 4.0 * f64::EPSILON * expected,
                "{phase} {expected}"
            );
        }
    }

    #[test]
    fn names_and_rows_belong_together() {
        let samples = Samples::reference().unwrap();
        for id in TrajectoryId::all() {
            let trajectory = samples.trajectory(id);
            let name = format!("({},{})", trajectory.path, trajectory.speed);
            assert_eq!(name, label(id));
        }
        assert_eq!(samples.states().count(), 16 * N_SAMPLES);
    }

    #[test]
    fn a_faster_run_has_four_and_sixteen_times_the_rates() {
        // Section 2.2: (p1,s1) traces (q, q̇, q̈)(φ), (p1,s4) traces (q, 4 q̇, 16 q̈)(φ).
        let samples = Samples::reference().unwrap();
        let pairs = samples
            .states_of(shown::NEAR_SLOW)
            .zip(samples.states_of(shown::NEAR_FAST));
        for (slow, fast) in pairs {
            for j in 0..N_COVARIATES {
                let factor = [1.0, 4.0, 16.0][j / N_JOINTS];
                let expected = factor * slow[j];
                let tolerance = 8.0 * f64::EPSILON * expected.abs();
                assert!(
                    (fast[j] - expected).abs() <= tolerance,
                    "{j}: {} {expected}",
                    fast[j]
                );
            }
        }
    }
}
