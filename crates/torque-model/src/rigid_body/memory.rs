//! The hysteresis states of a motion, one step after another.

use faer::Mat;
use puma_dyn::robot::next_hysteresis;

use crate::error::TorqueError;
use crate::rigid_body::log::Log;
use crate::rigid_body::unknowns::Unknowns;
use crate::samples::Samples;

/// Hysteresis states z of all joints, for each length δ, as a model wants them behind (q, q̇, q̈).
///
/// One multiplication, one addition and one exponential per state and step; nothing is allocated.
#[derive(Debug, Clone, PartialEq)]
pub struct FrictionMemory {
    lengths: Vec<f64>,
    n_joints: usize,
    z: Vec<f64>,
}

impl FrictionMemory {
    /// The states at the beginning of a motion: zero.
    ///
    /// # Shapes
    /// `lengths`, rad, as [`crate::RobotModel::hysteresis_lengths`] has them.
    pub fn new(lengths: &[f64], n_joints: usize) -> Self {
        Self {
            lengths: lengths.to_vec(),
            n_joints,
            z: vec![0.0; lengths.len() * n_joints],
        }
    }

    /// z, all joints of the first length, then of the next.
    pub fn states(&self) -> &[f64] {
        &self.z
    }

    /// Forgets the past: all states are zero.
    pub fn reset(&mut self) {
        self.z.fill(0.0);
    }

    /// Every joint travels straight from one position to another; the time that it takes does not matter.
    ///
    /// # Panics
    /// If there are fewer positions than joints.
    pub fn travel(&mut self, from: &[f64], to: &[f64]) {
        let of_lengths = self.z.chunks_exact_mut(self.n_joints.max(1));
        for (length, z) in self.lengths.iter().zip(of_lengths) {
            for (joint, z) in z.iter_mut().enumerate() {
                *z = next_hysteresis(*z, to[joint] - from[joint], 1.0, *length);
            }
        }
    }

    /// Every joint moves at q̇ for `step` seconds; see [`next_hysteresis`].
    ///
    /// # Panics
    /// If `qd` is shorter than the number of joints.
    pub fn advance(&mut self, qd: &[f64], step: f64) {
        let of_lengths = self.z.chunks_exact_mut(self.n_joints.max(1));
        for (length, z) in self.lengths.iter().zip(of_lengths) {
            for (joint, z) in z.iter_mut().enumerate() {
                *z = next_hysteresis(*z, qd[joint], step, *length);
            }
        }
    }
}

/// States (q, q̇, q̈, z) of the rows of samples, in their order: z from the timeline's columns or times.
///
/// # Shapes
/// (n, 3ℓ + ℓ for each length).
/// # Errors
/// [`TorqueError::Log`] where the samples have neither; times that do not rise.
pub(crate) fn states_with_memory(
    samples: &Samples,
    unknowns: &Unknowns,
) -> Result<Mat<f64>, TorqueError> {
    let lengths = unknowns.lengths();
    if lengths.is_empty() {
        return Ok(samples.x.to_owned());
    }
    let log = Log::new(samples)?;
    log.require_memory(lengths)?;
    let n = samples.x.ncols();
    let mut states = Mat::zeros(samples.n_rows(), unknowns.n_covariates());
    for run in &log.runs {
        let mut z = vec![0.0; lengths.len() * samples.n_joints()];
        for (row, place) in run.rows.iter().enumerate() {
            log.advance(run, row, lengths, &mut z);
            for col in 0..n {
                states[(*place, col)] = samples.x[(*place, col)];
            }
            for (z, col) in z.iter().zip(n..) {
                states[(*place, col)] = *z;
            }
        }
    }
    Ok(states)
}
