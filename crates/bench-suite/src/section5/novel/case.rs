//! What is measured of a new load, in each profile: samples of it, and what is predicted.

use faer::Mat;
use serde::Deserialize;

/// Settings of a profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    pub n_total: usize,
    pub load: usize,
    pub counts: Vec<usize>,
    pub draws: usize,
    pub torque_noise: Vec<f64>,
    pub test_stride: usize,
}

/// One number of samples of one draw with one noise.
#[derive(Debug, Clone, Copy)]
pub struct Case {
    pub draw: usize,
    pub noise_idx: usize,
    pub count: usize,
}

/// Samples of the new load.
pub struct Samples {
    /// (k, 18).
    pub x: Mat<f64>,
    /// Torques of each joint, (6, k), N·m.
    pub torques: Vec<Vec<f64>>,
    /// Standard deviation of their noise, N·m.
    pub noise_std: f64,
}

/// What is predicted.
pub struct Test {
    /// (p, 18).
    pub x: Mat<f64>,
    /// Torques of each joint, (6, p), N·m.
    pub torques: Vec<Vec<f64>>,
}
