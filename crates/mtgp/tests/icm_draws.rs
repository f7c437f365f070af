//! Torques drawn from eq. (16) with hyperparameters that are known.

use faer::{Mat, MatRef};
use kernels::{Covariance, TorqueCovariance, TorqueParams};
use linalg::Factor;
use mtgp::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub struct Draw {
    pub data: Stacked,
    /// In the order of the rows.
    pub targets: Vec<f64>,
    pub truth: MultiTaskCovariance,
    pub noise_std: f64,
}

/// Four tasks of a robot with one joint, of rank 2, each at its own inputs.
pub fn four_tasks_of_rank_two(seed: u64, n_per_task: usize) -> Draw {
    let input = TorqueCovariance::new(TorqueParams {
        bias_std: 0.5,
        linear_std: vec![0.4, 0.8, 0.6],
        signal_std: 1.5,
        length_scales: vec![1.5, 3.0, 2.0],
        coulomb_std: Some(vec![0.7]),
    })
    .unwrap();
    let entries = [1.0, 0.8, 0.7, -0.6, 0.9, 1.1, -0.5];
    let factor = TaskFactor::from_entries(4, 2, &entries).unwrap();
    let truth = MultiTaskCovariance::new(input, TaskCovariance::Factor(factor));
    let (data, targets) = drawn(&truth, 0.05, seed, n_per_task);
    Draw {
        data,
        targets,
        truth,
        noise_std: 0.05,
    }
}

pub fn drawn(
    truth: &MultiTaskCovariance,
    noise_std: f64,
    seed: u64,
    n_per_task: usize,
) -> (Stacked, Vec<f64>) {
    let n = truth.n_tasks() * n_per_task;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut x = Mat::zeros(n, 3);
    for row in 0..n {
        for col in 0..3 {
            x[(row, col)] = 4.0 * rng.random::<f64>() - 2.0;
        }
    }
    // Tasks take turns, so that stacking has something to sort.
    let tasks: Vec<usize> = (0..n).map(|row| row % truth.n_tasks()).collect();
    let data = Stacked::new(x.as_ref(), &tasks, truth.n_tasks()).unwrap();

    let targets = torques(truth, noise_std, data.inputs(), &mut rng);
    (data, targets)
}

/// Torques at rows (x, task).
pub fn torques(
    truth: &impl Covariance,
    noise_std: f64,
    rows: MatRef<'_, f64>,
    rng: &mut ChaCha8Rng,
) -> Vec<f64> {
    let n = rows.nrows();
    let mut k = truth.gram(rows);
    for idx in 0..n {
        k[(idx, idx)] += noise_std * noise_std;
    }
    let factor = Factor::new(k).unwrap();
    let z: Vec<f64> = (0..n).map(|_| normal(rng)).collect();
    (0..n)
        .map(|row| (0..=row).map(|col| factor.l()[(row, col)] * z[col]).sum())
        .collect()
}

/// A standard normal number by the method of Box and Muller.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let (radius, angle): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - radius).ln()).sqrt() * (std::f64::consts::TAU * angle).cos()
}
