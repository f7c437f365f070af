//! Synthetic motion along smooth closed curves, whose covariance matrices are of low rank.

use faer::Mat;
use kernels::{TorqueCovariance, TorqueParams};

/// Samples (q, q̇, q̈) of six joints along two closed curves, (n, 18), in no particular order.
pub fn inputs(n: usize) -> Mat<f64> {
    let mut x = Mat::zeros(n, 18);
    for row in 0..n {
        // 0.618… n never repeats: every phase is new, as in a shuffled recording.
        let phase = std::f64::consts::TAU * (row as f64 * 0.618_033_988_749_895).fract();
        let (speed, shape) = [(1.0, 0.0), (1.7, 0.9)][row % 2];
        for joint in 0..6 {
            let turns = 1.0 + (joint % 3) as f64;
            let size = 0.8 / turns;
            let angle = turns * phase + shape + 0.5 * joint as f64;
            x[(row, joint)] = size * angle.sin() + 0.3 * shape;
            x[(row, 6 + joint)] = size * turns * speed * angle.cos();
            x[(row, 12 + joint)] = -size * turns * turns * speed * speed * angle.sin();
        }
    }
    x
}

/// A torque with gravity, inertia, a velocity product and friction, and noise below σ.
pub fn targets(x: &Mat<f64>) -> Vec<f64> {
    (0..x.nrows())
        .map(|row| {
            let at = |col: usize| x[(row, col)];
            let smooth = 20.0 * (at(0) + at(1)).cos() + 3.0 * at(12) + at(13) * at(1).cos();
            let noise = 0.02 * (7919.0 * row as f64).sin();
            smooth - 0.7 * at(6) * at(7) + 1.5 * at(6).signum() + noise
        })
        .collect()
}

/// Hyperparameters like those that fits to such data end with.
pub fn covariance(stretch: f64) -> TorqueCovariance {
    let length_scales = (0..18).map(|j| stretch * (1.5 + 0.4 * f64::from(j)));
    TorqueCovariance::new(TorqueParams {
        bias_std: 8.0,
        linear_std: vec![0.5; 18],
        signal_std: 15.0,
        length_scales: length_scales.collect(),
        coulomb_std: Some(vec![1.5, 0.2, 0.1, 0.1, 0.1, 0.1]),
    })
    .unwrap()
}
