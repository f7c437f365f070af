//! One run of the arm: positions, rates and accelerations of its joints at regular times.

use crate::chapter::puma560;

/// Number of joints of the arm.
pub(crate) const N_JOINTS: usize = puma560::N_JOINTS;
/// Number of columns of a state: q, qd, qdd.
pub(crate) const N_STATE: usize = 3 * N_JOINTS;

/// One run along a path: the same for every load.
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// Name of the path and the speed, such as `p1` and `s4`.
    pub path: String,
    /// Name of the speed.
    pub speed: String,
    /// Time of each sample, s.
    pub time: Vec<f64>,
    /// (n_samples, 18) row-major: q rad, qd rad/s, qdd rad/s².
    pub states: Vec<f64>,
}

impl Trajectory {
    /// Number of samples.
    pub fn n_samples(&self) -> usize {
        self.time.len()
    }

    /// Positions, rates and accelerations of one sample, (6,) each.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn state(&self, sample_idx: usize) -> (&[f64], &[f64], &[f64]) {
        let row = &self.states[sample_idx * N_STATE..(sample_idx + 1) * N_STATE];
        let (q, rates) = row.split_at(N_JOINTS);
        let (qd, qdd) = rates.split_at(N_JOINTS);
        (q, qd, qdd)
    }
}
