//! The new load by physics: its ten inertial parameters from torques, all else known.

use faer::{Mat, MatRef};
use puma_dyn::dynamics::N_PARAMETERS;
use puma_dyn::{Context, Scenario, Workspace, regressor, rnea};

use crate::dataset::N_JOINTS;
use crate::error::BenchError;

/// Standard deviations of the parameters before any torque: mass kg, its moments kg m, inertias kg m².
///
/// Loads of a few kilograms within a few decimetres; what is known beside Y.
const SPREAD: [f64; N_PARAMETERS] = [3.0, 0.5, 0.5, 0.5, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1];

/// Smallest noise that the regression assumes, N·m: rounding of simulated torques.
const LEAST_NOISE: f64 = 1e-9;

/// What the robot's torques are at some states, with none of the load and with a unit of each of its parameters.
pub struct LoadRegression {
    /// Torques without a load, (6, n).
    unloaded: Vec<Vec<f64>>,
    /// Torques of a unit of each parameter times its spread, (n, 10) for each joint.
    of_load: Vec<Mat<f64>>,
}

impl LoadRegression {
    /// Evaluates the robot's own dynamics and the last link's columns of Y.
    ///
    /// # Shapes
    /// `x` (n, 18).
    /// # Source
    /// Eqs. (10)–(12).
    pub fn new(x: MatRef<'_, f64>) -> Self {
        let scenario = Scenario::reference();
        let model = scenario.model();
        let mut workspace = Workspace::new(model);
        let nothing = Context::new([]);
        let n = x.nrows();
        let mut unloaded = vec![vec![0.0; n]; N_JOINTS];
        let mut of_load = vec![Mat::zeros(n, N_PARAMETERS); N_JOINTS];
        let mut y = vec![0.0; N_JOINTS * N_JOINTS * N_PARAMETERS];
        let mut tau = [0.0; N_JOINTS];
        for sample in 0..n {
            let state: Vec<f64> = x.row(sample).iter().copied().collect();
            let (q, rates) = state.split_at(N_JOINTS);
            let (qd, qdd) = rates.split_at(N_JOINTS);
            let effects = scenario.effects();
            rnea(
                model,
                &mut workspace,
                effects,
                &nothing,
                q,
                qd,
                qdd,
                &mut tau,
            );
            regressor(model, &mut workspace, q, qd, qdd, &mut y);
            for joint in 0..N_JOINTS {
                unloaded[joint][sample] = tau[joint];
                let row = &y[joint * N_JOINTS * N_PARAMETERS..][..N_JOINTS * N_PARAMETERS];
                let last = &row[(N_JOINTS - 1) * N_PARAMETERS..];
                for (parameter, value) in last.iter().enumerate() {
                    of_load[joint][(sample, parameter)] = value * SPREAD[parameter];
                }
            }
        }
        Self { unloaded, of_load }
    }

    /// The parameters in units of their spread, (10,), from torques of all joints.
    ///
    /// ```text
    /// π = V diag(s/(s² + σ²)) Uᵀ (τ − τ_unloaded),   Y = U diag(s) Vᵀ
    /// ```
    /// the mean given the torques under π ~ N(0, I); without noise the shortest exact solution.
    /// # Shapes
    /// `torques` (6, n), at the states of `self`, N·m.
    /// # Errors
    /// `Decomposition` if the singular values are not found.
    pub fn parameters(&self, torques: &[Vec<f64>], noise_std: f64) -> Result<Vec<f64>, BenchError> {
        let n = self.of_load[0].nrows();
        let y = Mat::from_fn(N_JOINTS * n, N_PARAMETERS, |row, parameter| {
            self.of_load[row / n][(row % n, parameter)]
        });
        let svd = y.thin_svd().map_err(|error| BenchError::Decomposition {
            message: format!("{error:?}"),
        })?;
        let residual = |row: usize| torques[row / n][row % n] - self.unloaded[row / n][row % n];
        let noise_var = noise_std.max(LEAST_NOISE).powi(2);
        let mut parameters = vec![0.0; N_PARAMETERS];
        for (place, s) in svd.S().column_vector().iter().enumerate() {
            let left = svd.U().col(place);
            let along: f64 = left
                .iter()
                .enumerate()
                .map(|(row, u)| u * residual(row))
                .sum();
            let size = along * s / (s * s + noise_var);
            for (value, v) in parameters.iter_mut().zip(svd.V().col(place).iter()) {
                *value += size * v;
            }
        }
        Ok(parameters)
    }

    /// Torques of a joint, from 0, at the states of `self` under a load, N·m.
    ///
    /// # Shapes
    /// `parameters` (10,) as [`LoadRegression::parameters`] has them.
    pub fn predict(&self, joint_idx: usize, parameters: &[f64]) -> Vec<f64> {
        let columns = &self.of_load[joint_idx];
        let torque = |(sample, unloaded): (usize, &f64)| {
            let products = columns.row(sample).iter().zip(parameters);
            unloaded + products.map(|(y, pi)| y * pi).sum::<f64>()
        };
        self.unloaded[joint_idx]
            .iter()
            .enumerate()
            .map(torque)
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::dataset::DataSet;

    #[test]
    fn ten_samples_without_noise_give_the_load_of_the_simulation() {
        let data = DataSet::simulate(&BTreeSet::from([15])).unwrap();
        let seen: Vec<usize> = (0..10).map(|i| 24_000 + 397 * i).collect();
        let elsewhere: Vec<usize> = (0..50).map(|i| 1_279 * i).collect();
        let torques = |rows: &[usize]| -> Vec<Vec<f64>> {
            (1..=N_JOINTS)
                .map(|joint| data.torques(15, joint, rows))
                .collect()
        };
        let fitted = LoadRegression::new(data.x(&seen).as_ref())
            .parameters(&torques(&seen), 0.0)
            .unwrap();
        // Σ over a mass of 3 kg in units of 3 kg.
        assert!((fitted[0] - 1.0).abs() <= 1e-6, "{fitted:?}");
        let there = LoadRegression::new(data.x(&elsewhere).as_ref());
        for (joint_idx, expected) in torques(&elsewhere).iter().enumerate() {
            for (found, expected) in there.predict(joint_idx, &fitted).iter().zip(expected) {
                let error = (found - expected).abs();
                assert!(error <= 1e-7, "joint {}: {found} {expected}", joint_idx + 1);
            }
        }
    }

    #[test]
    fn threads_do_not_change_the_parameters() {
        let data = DataSet::simulate(&BTreeSet::from([15])).unwrap();
        let seen: Vec<usize> = (0..200).map(|i| 24_000 + 17 * i).collect();
        let regression = LoadRegression::new(data.x(&seen).as_ref());
        let torques: Vec<Vec<f64>> = (1..=N_JOINTS)
            .map(|joint| data.torques(15, joint, &seen))
            .collect();
        let bits = |n_threads| -> Vec<u64> {
            let pool = crate::run::thread_pool(n_threads).unwrap();
            let parameters = pool.install(|| regression.parameters(&torques, 0.0));
            parameters.unwrap().iter().map(|v| v.to_bits()).collect()
        };
        assert_eq!(bits(1), bits(2));
    }
}
