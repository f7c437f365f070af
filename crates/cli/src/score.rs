//! How well a model predicts measured torques.

use std::f64::consts::PI;

use serde::Serialize;

/// Quantile of the standard normal that leaves 2.5 % above it. Source: Abramowitz & Stegun 1964, table 26.5.
const NORMAL_975: f64 = 1.959_963_984_540_054;

/// Measures of one joint's predictions at n test samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Score {
    /// Mean squared error / variance of the test torques (divisor n); `None` if these are all equal.
    pub nmse: Option<f64>,
    /// Root of the mean squared error, N·m.
    pub rmse: f64,
    /// Mean over the samples of log p(torque), natural log of a density per N·m, with observation noise.
    pub mean_log_predictive_density: f64,
    /// Part of the torques inside the interval that should hold 95 % of them.
    pub coverage_95: f64,
}

impl Score {
    /// Compares predictions with measured torques.
    ///
    /// ```text
    /// s² = var + σ²,  log p(t) = −½ log 2πs² − (t − m)²/2s²,  inside: |t − m| ≤ 1.96 s
    /// ```
    /// # Shapes
    /// `torques`, `mean`, `var`, `noise_var` (n,), n ≥ 1; `var` latent, `noise_var` = σ², N²·m².
    /// # Panics
    /// If the lengths differ.
    pub fn of(torques: &[f64], mean: &[f64], var: &[f64], noise_var: &[f64]) -> Self {
        assert!(torques.len() == mean.len() && mean.len() == var.len());
        assert_eq!(var.len(), noise_var.len());
        let n = torques.len() as f64;
        let centre = torques.iter().sum::<f64>() / n;
        let spread: f64 = torques.iter().map(|t| (t - centre).powi(2)).sum();
        let (mut squares, mut log_density, mut n_inside) = (0.0, 0.0, 0_u32);
        for (((t, m), var), noise_var) in torques.iter().zip(mean).zip(var).zip(noise_var) {
            let (square, observed_var) = ((t - m).powi(2), var + noise_var);
            squares += square;
            log_density -= 0.5 * (2.0 * PI * observed_var).ln() + 0.5 * square / observed_var;
            n_inside += u32::from(square.sqrt() <= NORMAL_975 * observed_var.sqrt());
        }
        Self {
            nmse: (!is_constant(torques)).then(|| squares / spread),
            rmse: (squares / n).sqrt(),
            mean_log_predictive_density: log_density / n,
            coverage_95: f64::from(n_inside) / n,
        }
    }

    /// The mean of every measure; of nMSE over those that have one.
    ///
    /// # Panics
    /// If there are none.
    pub fn average(scores: &[Self]) -> Self {
        assert!(!scores.is_empty());
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        let mean_of = |measure: fn(&Self) -> f64| mean(scores.iter().map(measure).collect());
        let nmse: Vec<f64> = scores.iter().filter_map(|score| score.nmse).collect();
        Self {
            nmse: (!nmse.is_empty()).then(|| mean(nmse)),
            rmse: mean_of(|score| score.rmse),
            mean_log_predictive_density: mean_of(|score| score.mean_log_predictive_density),
            coverage_95: mean_of(|score| score.coverage_95),
        }
    }
}

/// Whether all values are equal; their computed variance need not be zero then.
pub fn is_constant(values: &[f64]) -> bool {
    values
        .windows(2)
        .all(|pair| pair[0].total_cmp(&pair[1]).is_eq())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worked_by_hand() {
        // Errors 1, 0, −2: MSE 5/3; torques 1, 2, 3 have variance 2/3. s² = 1: |e| ≤ 1.96 twice.
        let score = Score::of(&[1.0, 2.0, 3.0], &[0.0, 2.0, 5.0], &[0.75; 3], &[0.25; 3]);
        let log_density = -0.5 * (2.0 * PI).ln() - 0.5 * 5.0 / 3.0;
        assert!((score.nmse.unwrap() - 2.5).abs() <= 1e-15, "{score:?}");
        assert!(
            (score.rmse - (5.0_f64 / 3.0).sqrt()).abs() <= 1e-15,
            "{score:?}"
        );
        assert!(
            (score.mean_log_predictive_density - log_density).abs() <= 1e-15,
            "{score:?}"
        );
        assert!((score.coverage_95 - 2.0 / 3.0).abs() <= 1e-15, "{score:?}");
    }

    #[test]
    fn equal_torques_have_no_nmse() {
        // 0.1 three times: the computed mean is not 0.1.
        assert_eq!(
            Score::of(&[0.1; 3], &[0.1; 3], &[0.0; 3], &[1.0; 3]).nmse,
            None
        );
    }
}
