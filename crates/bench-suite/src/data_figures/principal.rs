//! Principal components of the sampled covariates.

use faer::{Mat, Side};

use super::samples::N_COVARIATES;
use crate::error::BenchError;

/// How covariates are scaled before the analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scaling {
    /// Each divided by its standard deviation: the eigenvalues belong to the correlation matrix.
    Standardised,
    /// In their own units, rad, rad/s and rad/s².
    Raw,
}

/// Directions of largest variance, and the variances along them.
///
/// ```text
/// z = (x − mean) / scale,   C = (1/n) Σ z zᵀ = V diag(λ) Vᵀ,   λ_1 ≥ … ≥ λ_18
/// score_k(x) = v_kᵀ z
/// ```
/// The sign of v_k is chosen so that the score of largest magnitude is negative, a rule picked after a look
/// at the ticks of figs. 3 and 6.
///
/// # Source
/// Section 2.2.
#[derive(Debug, Clone)]
pub struct PrincipalComponents {
    /// Means of the covariates.
    pub mean: Vec<f64>,
    /// Their standard deviations (divisor n), or ones.
    pub scale: Vec<f64>,
    /// λ, descending.
    pub variances: Vec<f64>,
    /// (18, 18), column k is v_k.
    pub directions: Mat<f64>,
}

impl PrincipalComponents {
    /// Analyses states of 18 numbers each.
    ///
    /// # Errors
    /// `Decomposition` if the eigendecomposition does not converge.
    ///
    /// # Panics
    /// If a state has not 18 numbers.
    pub fn of<'a>(
        states: impl Iterator<Item = &'a [f64]> + Clone,
        scaling: Scaling,
    ) -> Result<Self, BenchError> {
        let (mean, covariance) = moments(states.clone());
        let scale: Vec<f64> = match scaling {
            Scaling::Standardised => (0..N_COVARIATES)
                .map(|j| covariance[(j, j)].sqrt())
                .collect(),
            Scaling::Raw => vec![1.0; N_COVARIATES],
        };
        let scaled = Mat::from_fn(N_COVARIATES, N_COVARIATES, |i, j| {
            covariance[(i, j)] / (scale[i] * scale[j])
        });

        let eigen =
            scaled
                .self_adjoint_eigen(Side::Lower)
                .map_err(|error| BenchError::Decomposition {
                    message: format!("{error:?}"),
                })?;
        // faer sorts ascending.
        let last = N_COVARIATES - 1;
        let values = eigen.S().column_vector();
        let mut components = Self {
            mean,
            scale,
            variances: (0..N_COVARIATES).map(|k| values[last - k]).collect(),
            directions: Mat::from_fn(N_COVARIATES, N_COVARIATES, |i, k| eigen.U()[(i, last - k)]),
        };
        components.orient(states);
        Ok(components)
    }

    /// Scores of a state on the first `n` components.
    ///
    /// # Panics
    /// If the state has not 18 numbers, or `n` exceeds them.
    pub fn scores(&self, state: &[f64], n: usize) -> Vec<f64> {
        assert_eq!(state.len(), N_COVARIATES);
        let z = |j: usize| (state[j] - self.mean[j]) / self.scale[j];
        (0..n)
            .map(|k| {
                (0..N_COVARIATES)
                    .map(|j| self.directions[(j, k)] * z(j))
                    .sum()
            })
            .collect()
    }

    /// Proportion of the variance that the first k components explain, for k = 0 to 18.
    pub fn cumulative(&self) -> Vec<f64> {
        let total: f64 = self.variances.iter().sum();
        let mut sum = 0.0;
        let steps = self.variances.iter().map(|variance| {
            sum += variance;
            sum / total
        });
        std::iter::once(0.0).chain(steps).collect()
    }

    /// Turns each direction so that the score of largest magnitude is negative.
    fn orient<'a>(&mut self, states: impl Iterator<Item = &'a [f64]>) {
        let mut largest = [0.0_f64; N_COVARIATES];
        for state in states {
            let scores = self.scores(state, N_COVARIATES);
            for (largest, score) in largest.iter_mut().zip(scores) {
                if score.abs() > largest.abs() {
                    *largest = score;
                }
            }
        }
        for (k, score) in largest.into_iter().enumerate() {
            if score > 0.0 {
                for j in 0..N_COVARIATES {
                    self.directions[(j, k)] = -self.directions[(j, k)];
                }
            }
        }
    }
}

/// Means, (18,), and covariances with divisor n, (18, 18).
fn moments<'a>(states: impl Iterator<Item = &'a [f64]> + Clone) -> (Vec<f64>, Mat<f64>) {
    let mut mean = vec![0.0; N_COVARIATES];
    let mut n = 0.0;
    for state in states.clone() {
        assert_eq!(state.len(), N_COVARIATES);
        n += 1.0;
        for (sum, x) in mean.iter_mut().zip(state) {
            *sum += x;
        }
    }
    for sum in &mut mean {
        *sum /= n;
    }

    let mut covariance = Mat::<f64>::zeros(N_COVARIATES, N_COVARIATES);
    for state in states {
        for j in 0..N_COVARIATES {
            let deviation = (state[j] - mean[j]) / n;
            for i in 0..N_COVARIATES {
                covariance[(i, j)] += (state[i] - mean[i]) * deviation;
            }
        }
    }
    (mean, covariance)
}

/// Names of the covariates in CSV files: q1 … q6, qd1 … qd6, qdd1 … qdd6.
pub fn covariate_names() -> Vec<String> {
    let joints = N_COVARIATES / 3;
    let name = |j: usize| format!("{}{}", ["q", "qd", "qdd"][j / joints], j % joints + 1);
    (0..N_COVARIATES).map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data_figures::samples::{Samples, shown};
    use crate::split::N_ROWS;

    /// Rounding of a mean of 64,000 products of standardised covariates, whose mean size is at most 1, in 18 rows:
    ///
    /// ```text
    /// |Δλ| ≤ ‖ΔC‖ ≤ 18 n ε
    /// ```
    const EIGENVALUE_ERROR: f64 = N_COVARIATES as f64 * N_ROWS as f64 * f64::EPSILON;

    fn components(scaling: Scaling) -> PrincipalComponents {
        PrincipalComponents::of(Samples::reference().unwrap().states(), scaling).unwrap()
    }

    /// Columns of the numbers that numpy found.
    fn numpy(column: &str) -> Vec<f64> {
        let text = include_str!("../../../../fixtures/bench-suite/principal_components.csv");
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().unwrap();
        let at = header.iter().position(|name| *name == column).unwrap();
        lines.map(|row| row[at].parse().unwrap()).collect()
    }

    #[test]
    fn variances_are_those_of_numpy() {
        for (scaling, column) in [
            (Scaling::Standardised, "variance_standardised"),
            (Scaling::Raw, "variance_raw"),
        ] {
            let ours = components(scaling).variances;
            let expected = numpy(column);
            // Raw covariances are as large as their trace.
            let size = expected.iter().sum::<f64>() / N_COVARIATES as f64;
            for (ours, expected) in ours.iter().zip(&expected) {
                let error = (ours - expected).abs();
                assert!(
                    error <= EIGENVALUE_ERROR * size.max(1.0),
                    "{ours} {expected}"
                );
            }
        }
    }

    #[test]
    fn directions_are_those_of_numpy_up_to_their_sign() {
        let ours = components(Scaling::Standardised);
        for k in 0..3_usize {
            let expected = numpy(&format!("v{}", k + 1));
            // First-order perturbation: ‖ΔC‖ over the gap to the next eigenvalue.
            let before = k
                .checked_sub(1)
                .map_or(f64::INFINITY, |i| ours.variances[i]);
            let gap = (before - ours.variances[k]).min(ours.variances[k] - ours.variances[k + 1]);
            let column: Vec<f64> = (0..N_COVARIATES).map(|j| ours.directions[(j, k)]).collect();
            let dot: f64 = column.iter().zip(&expected).map(|(a, b)| a * b).sum();
            for (a, b) in column.iter().zip(&expected) {
                let error = (a - dot.signum() * b).abs();
                assert!(
                    error <= 2.0 * EIGENVALUE_ERROR / gap,
                    "PC{}: {a} {b}",
                    k + 1
                );
            }
        }
    }

    #[test]
    fn variances_add_up_to_the_trace_and_all_scores_rebuild_the_state() {
        let samples = Samples::reference().unwrap();
        let ours = components(Scaling::Standardised);
        let total: f64 = ours.variances.iter().sum();
        assert!(
            (total - N_COVARIATES as f64).abs() <= EIGENVALUE_ERROR,
            "{total}"
        );
        assert!((ours.cumulative()[N_COVARIATES] - 1.0).abs() <= 18.0 * f64::EPSILON);

        let state = samples.states_of(shown::NEAR_FAST).nth(1234).unwrap();
        let scores = ours.scores(state, N_COVARIATES);
        for (j, &x) in state.iter().enumerate() {
            let z: f64 = (0..N_COVARIATES)
                .map(|k| ours.directions[(j, k)] * scores[k])
                .sum();
            let rebuilt = ours.mean[j] + ours.scale[j] * z;
            // Orthogonality to 18 ε and two sums of 18 terms.
            let tolerance = 100.0 * f64::EPSILON * (x.abs() + 10.0 * ours.scale[j]);
            assert!((rebuilt - x).abs() <= tolerance, "{j}: {rebuilt} {x}");
        }
    }

    #[test]
    fn the_longest_arm_of_every_component_is_negative() {
        let samples = Samples::reference().unwrap();
        let ours = components(Scaling::Standardised);
        let (mut low, mut high) = ([0.0_f64; 3], [0.0_f64; 3]);
        for state in samples.states() {
            for (k, score) in ours.scores(state, 3).into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(score), high[k].max(score));
            }
        }
        assert!((0..3).all(|k| -low[k] > high[k]), "{low:?} {high:?}");
    }
}
