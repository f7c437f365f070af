//! States and torques of section 2: 16 trajectories of 4000 samples, under each load.

use std::collections::{BTreeMap, BTreeSet};

use faer::Mat;
use puma_dyn::Scenario;
use rayon::prelude::*;

use crate::error::BenchError;
use crate::split::{N_ROWS, N_SAMPLES};

/// Joints of the PUMA 560.
pub const N_JOINTS: usize = 6;
/// Covariates (q, q̇, q̈).
const N_COVARIATES: usize = 3 * N_JOINTS;

/// The reference scenario sampled: inputs shared by all loads, torques of each.
///
/// Rows follow [`crate::split::TrajectoryId::all`], 4000 each; torques carry no noise.
pub struct DataSet {
    /// (64,000, 18), row-major; rad, rad/s, rad/s².
    states: Vec<f64>,
    /// Load from 1 → (64,000, 6), row-major, N·m.
    torques: BTreeMap<usize, Vec<f64>>,
}

impl DataSet {
    /// Simulates the loads given, from 1.
    ///
    /// # Errors
    /// `Dynamics` if the scenario has an unreachable point or no such load;
    /// `Malformed` if its samples are not 16 × 4000.
    pub fn simulate(loads: &BTreeSet<usize>) -> Result<Self, BenchError> {
        let scenario = Scenario::reference();
        let trajectories = scenario.trajectories()?; // in the order of TrajectoryId::all
        let states: Vec<f64> = trajectories
            .iter()
            .flat_map(|t| t.states.iter().copied())
            .collect();
        if states.len() != N_ROWS * N_COVARIATES {
            let message = format!("{} numbers, not 16 × {N_SAMPLES} states", states.len());
            return Err(BenchError::malformed("fixtures/scenario.toml", message));
        }

        let load_idx = |load: &usize| Ok((*load, scenario.load_idx(&format!("c{load}"))?));
        let loads: Vec<(usize, usize)> = loads
            .iter()
            .map(load_idx)
            .collect::<Result<_, BenchError>>()?;
        let torques = loads
            .into_par_iter()
            .map(|(load, idx)| {
                let of_load = trajectories.iter().flat_map(|t| scenario.torques(t, idx));
                (load, of_load.collect())
            })
            .collect();
        Ok(Self { states, torques })
    }

    /// Inputs at rows of the data set.
    ///
    /// # Shapes
    /// (rows.len(), 18).
    /// # Panics
    /// If a row does not exist.
    pub fn x(&self, rows: &[usize]) -> Mat<f64> {
        Mat::from_fn(rows.len(), N_COVARIATES, |i, j| {
            self.states[rows[i] * N_COVARIATES + j]
        })
    }

    /// Torques of a joint under a load, both from 1, at rows of the data set, N·m.
    ///
    /// # Panics
    /// If the load was not simulated, or a row or the joint does not exist.
    pub fn torques(&self, load: usize, joint: usize, rows: &[usize]) -> Vec<f64> {
        assert!((1..=N_JOINTS).contains(&joint), "joint {joint}");
        let torques = &self.torques[&load];
        let at = |&row: &usize| torques[row * N_JOINTS + joint - 1];
        rows.iter().map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::split::{REFERENCE, TrajectoryId};

    #[test]
    fn trajectories_come_in_the_order_of_the_rows() {
        let names: Vec<(String, String)> = Scenario::reference()
            .trajectories()
            .unwrap()
            .into_iter()
            .map(|t| (t.path, t.speed))
            .collect();
        let expected: Vec<(String, String)> = TrajectoryId::all()
            .map(|id| {
                (
                    format!("p{}", id.path_idx + 1),
                    format!("s{}", id.speed_idx + 1),
                )
            })
            .collect();
        assert_eq!(names, expected);
    }

    #[test]
    fn rows_are_where_the_split_looks_for_them() {
        let data = DataSet::simulate(&BTreeSet::from([3])).unwrap();
        let scenario = Scenario::reference();
        let trajectory = scenario.trajectory(1, 2).unwrap(); // (p2, s3)
        let torques = scenario.torques(&trajectory, 2); // c3

        let row = REFERENCE.rows().start + 17;
        let x = data.x(&[row]);
        for j in 0..N_COVARIATES {
            assert_eq!(
                x[(0, j)].to_bits(),
                trajectory.states[17 * N_COVARIATES + j].to_bits()
            );
        }
        let torque = data.torques(3, 6, &[row])[0];
        assert_eq!(torque.to_bits(), torques[17 * N_JOINTS + 5].to_bits());
    }
}
