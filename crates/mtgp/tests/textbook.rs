//! The multi-task formulas as a textbook writes them: the whole matrix, entry by entry, and loops.

use faer::{Mat, MatRef};
use kernels::{Covariance, TorqueCovariance, TorqueParams};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Observations in any order, and the process that is thought to have made them.
pub struct Case {
    pub covariance: TorqueCovariance,
    pub k_task: Mat<f64>,
    pub noise_std: Vec<f64>,
    /// One row per observation, (n, d).
    pub x: Mat<f64>,
    pub tasks: Vec<usize>,
    pub targets: Vec<f64>,
}

/// Value and gradient of the log marginal likelihood.
pub struct Likelihood {
    pub value: f64,
    pub theta: Vec<f64>,
    pub k_task: Mat<f64>,
    pub noise_std: Vec<f64>,
}

impl Case {
    /// (K^ρ)_γδ c^x(x, x′), with noise on the diagonal.
    pub fn covariance_matrix(&self) -> Mat<f64> {
        let k_x = self.covariance.gram(self.x.as_ref());
        Mat::from_fn(self.x.nrows(), self.x.nrows(), |a, b| {
            let noise = if a == b {
                self.noise_std[self.tasks[a]].powi(2)
            } else {
                0.0
            };
            self.k_task[(self.tasks[a], self.tasks[b])] * k_x[(a, b)] + noise
        })
    }

    /// n ε tr K / λ_min: how far rounding can take any method, relative to what it computes.
    pub fn rounding(&self) -> f64 {
        let k = self.covariance_matrix();
        let trace: f64 = (0..k.nrows()).map(|i| k[(i, i)]).sum();
        let smallest = self
            .noise_std
            .iter()
            .fold(f64::INFINITY, |s, v| s.min(v * v));
        k.nrows() as f64 * f64::EPSILON * trace / smallest
    }

    /// Eq. (8) and its derivatives with Q = ½(αα′ − K⁻¹).
    pub fn likelihood(&self) -> Likelihood {
        let n = self.targets.len();
        let l = cholesky(&self.covariance_matrix());
        let alpha = solve(&l, &self.targets);
        let quadratic = dot(&alpha, &self.targets);
        let log_det: f64 = (0..n).map(|i| 2.0 * l[(i, i)].ln()).sum();
        let value = -0.5 * (quadratic + log_det + n as f64 * (2.0 * std::f64::consts::PI).ln());

        let mut q = Mat::zeros(n, n);
        for b in 0..n {
            let column = solve(&l, &unit(n, b));
            for a in 0..n {
                q[(a, b)] = 0.5 * (alpha[a] * alpha[b] - column[a]);
            }
        }
        let weighted = Mat::from_fn(n, n, |a, b| {
            q[(a, b)] * self.k_task[(self.tasks[a], self.tasks[b])]
        });
        let mut theta = vec![0.0; self.covariance.n_params()];
        (self.covariance).gram_adjoint(self.x.as_ref(), weighted.as_ref(), &mut theta);

        let m = self.noise_std.len();
        let k_x = self.covariance.gram(self.x.as_ref());
        let (mut k_task, mut noise_std) = (Mat::zeros(m, m), vec![0.0; m]);
        for a in 0..n {
            for b in 0..n {
                k_task[(self.tasks[a], self.tasks[b])] += q[(a, b)] * k_x[(a, b)];
            }
            noise_std[self.tasks[a]] += 2.0 * self.noise_std[self.tasks[a]] * q[(a, a)];
        }
        Likelihood {
            value,
            theta,
            k_task,
            noise_std,
        }
    }

    /// Eqs. (3) and (4) for one task: means and variances.
    pub fn predict(&self, task: usize, x_test: MatRef<'_, f64>) -> (Vec<f64>, Vec<f64>) {
        let l = cholesky(&self.covariance_matrix());
        let alpha = solve(&l, &self.targets);
        let k_xs = self.covariance.cross(self.x.as_ref(), x_test);
        let prior = self.covariance.diag(x_test);
        (0..x_test.nrows())
            .map(|test| {
                let k: Vec<f64> = (self.tasks.iter().enumerate())
                    .map(|(a, &of)| self.k_task[(task, of)] * k_xs[(a, test)])
                    .collect();
                let explained = dot(&k, &solve(&l, &k));
                (
                    dot(&k, &alpha),
                    self.k_task[(task, task)] * prior[test] - explained,
                )
            })
            .unzip()
    }
}

/// L of K = LLᵀ.
pub fn cholesky(k: &Mat<f64>) -> Mat<f64> {
    let n = k.nrows();
    let mut l = Mat::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let rest: f64 = k[(i, j)] - (0..j).map(|p| l[(i, p)] * l[(j, p)]).sum::<f64>();
            l[(i, j)] = if i == j {
                rest.sqrt()
            } else {
                rest / l[(j, j)]
            };
        }
    }
    assert!(l[(n - 1, n - 1)].is_finite());
    l
}

/// K⁻¹b by substitution.
pub fn solve(l: &Mat<f64>, b: &[f64]) -> Vec<f64> {
    let (n, mut y) = (b.len(), b.to_vec());
    for i in 0..n {
        let known: f64 = (0..i).map(|p| l[(i, p)] * y[p]).sum();
        y[i] = (y[i] - known) / l[(i, i)];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|p| l[(p, i)] * y[p]).sum();
        y[i] = (y[i] - known) / l[(i, i)];
    }
    y
}

fn unit(n: usize, at: usize) -> Vec<f64> {
    (0..n).map(|i| if i == at { 1.0 } else { 0.0 }).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Numbers between −1 and 1 from a named stream.
pub fn random(rows: usize, cols: usize, seed: u64) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Mat::from_fn(rows, cols, |_, _| rng.random_range(-1.0..1.0))
}

/// A covariance of two joints whose terms all matter for inputs between −1 and 1.
pub fn torque_covariance() -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.7,
        linear_std: vec![0.5, 0.3, 0.2, 0.4, 0.6, 0.1],
        signal_std: 1.3,
        length_scales: vec![0.8, 1.1, 0.9, 1.4, 1.0, 0.7],
        coulomb_std: Some(vec![0.4, 0.2]),
    })
    .unwrap()
}

/// Every task at every input, tasks one after the other, from T (ν, m).
pub fn complete_case(
    covariance: TorqueCovariance,
    k_task: &Mat<f64>,
    noise_std: &[f64],
    x: &Mat<f64>,
    targets: &Mat<f64>,
) -> Case {
    let (n_inputs, m) = (x.nrows(), noise_std.len());
    Case {
        covariance,
        k_task: k_task.clone(),
        noise_std: noise_std.to_vec(),
        x: Mat::from_fn(n_inputs * m, x.ncols(), |row, col| x[(row % n_inputs, col)]),
        tasks: (0..n_inputs * m).map(|row| row / n_inputs).collect(),
        targets: (0..m)
            .flat_map(|task| targets.col_as_slice(task).to_vec())
            .collect(),
    }
}

/// Fails unless two lists agree to `tolerance` times the largest expected entry.
pub fn assert_close(what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(0.0, |s: f64, v| s.max(v.abs()));
    for (idx, (f, e)) in found.iter().zip(expected).enumerate() {
        let error = (f - e).abs();
        assert!(
            error <= tolerance * scale,
            "{what}[{idx}]: {f} {e}, error {error:e} of {:e}",
            tolerance * scale
        );
    }
}

/// The entries of a matrix, column by column.
pub fn entries(matrix: &Mat<f64>) -> Vec<f64> {
    (0..matrix.ncols())
        .flat_map(|col| matrix.col_as_slice(col).to_vec())
        .collect()
}
