//! Means and variances of joints' torques at a set of states.

use faer::MatRef;

/// Means and variances of one joint's torque at a set of states.
#[derive(Debug, Clone, PartialEq)]
pub struct JointPrediction {
    /// Index of the joint among all joints of the robot.
    pub joint_idx: usize,
    /// Posterior means, N·m.
    pub mean: Vec<f64>,
    /// Variances of the latent (noise-free) torque, N²·m².
    pub var: Vec<f64>,
    /// Variances of the noise: add them to `var` for those of an observation, N²·m².
    pub noise_var: Vec<f64>,
}

/// Predictions of no row yet.
pub(crate) fn empty_predictions(
    joint_indices: &[usize],
    noise_vars: &[f64],
    n: usize,
) -> Vec<JointPrediction> {
    let of_joint = |(joint_idx, noise_var): (&usize, &f64)| JointPrediction {
        joint_idx: *joint_idx,
        mean: vec![0.0; n],
        var: vec![0.0; n],
        noise_var: vec![*noise_var; n],
    };
    joint_indices.iter().zip(noise_vars).map(of_joint).collect()
}

/// A row of a matrix as a slice of its own.
pub(crate) fn copy_row(x: MatRef<'_, f64>, row: usize, into: &mut [f64]) {
    for (entry, value) in into.iter_mut().zip(x.row(row).iter()) {
        *entry = *value;
    }
}
