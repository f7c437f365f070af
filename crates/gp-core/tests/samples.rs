//! Data drawn from a Gaussian process whose hyperparameters are known.

use faer::Mat;
use kernels::Covariance;
use linalg::Factor;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub fn uniform_inputs(seed: u64, n: usize, d: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut x = Mat::zeros(n, d);
    for row in 0..n {
        for col in 0..d {
            x[(row, col)] = 4.0 * rng.random::<f64>() - 2.0;
        }
    }
    x
}

/// Standard normal numbers by the polar method of Box and Muller.
pub fn normals(seed: u64, count: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count)
        .map(|_| {
            let (radius, angle): (f64, f64) = (rng.random(), rng.random());
            (-2.0 * (1.0 - radius).ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
        })
        .collect()
}

/// Targets t = L z with LLᵀ = c(X, X) + σ²I.
pub fn targets(seed: u64, covariance: &impl Covariance, noise_std: f64, x: &Mat<f64>) -> Vec<f64> {
    let mut k_xx = covariance.gram(x.as_ref());
    for idx in 0..x.nrows() {
        k_xx[(idx, idx)] += noise_std * noise_std;
    }
    let factor = Factor::new(k_xx).unwrap();
    let z = normals(seed, x.nrows());
    (0..x.nrows())
        .map(|row| (0..=row).map(|col| factor.l()[(row, col)] * z[col]).sum())
        .collect()
}
