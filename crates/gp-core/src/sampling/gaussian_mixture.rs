//! The mixture that predictions of several hyperparameters make.

use std::f64::consts::TAU;

use super::normal::normal_cdf;

/// Normal densities of one number in equal parts.
///
/// ```text
/// p(t) = (1/S) Σ_s N(t; mean_s, std_s²)
/// ```
/// # Source
/// Sec. 5, predictions averaged over s samples.
#[derive(Debug, Clone, PartialEq)]
pub struct GaussianMixture {
    means: Vec<f64>,
    stds: Vec<f64>,
}

impl GaussianMixture {
    /// The mixture of given means and variances.
    ///
    /// # Panics
    /// If there are none, or not as many of both, or a variance is not a number above zero.
    pub fn new(means: Vec<f64>, variances: &[f64]) -> Self {
        assert!(!means.is_empty() && means.len() == variances.len());
        assert!(
            variances.iter().all(|var| *var > 0.0),
            "a density needs a width"
        );
        let stds = variances.iter().map(|var| var.sqrt()).collect();
        Self { means, stds }
    }

    fn parts(&self) -> impl Iterator<Item = (f64, f64)> {
        self.means.iter().copied().zip(self.stds.iter().copied())
    }

    fn average(&self, of: impl Fn(f64, f64) -> f64) -> f64 {
        self.parts().map(|(mean, std)| of(mean, std)).sum::<f64>() / self.means.len() as f64
    }

    /// Mean.
    pub fn mean(&self) -> f64 {
        self.average(|mean, _| mean)
    }

    /// Variance: the mean of the variances and the variance of the means.
    pub fn variance(&self) -> f64 {
        let centre = self.mean();
        self.average(|mean, std| std * std + (mean - centre) * (mean - centre))
    }

    /// P(t ≤ `value`).
    pub fn cdf(&self, value: f64) -> f64 {
        self.average(|mean, std| normal_cdf((value - mean) / std))
    }

    /// Natural logarithm of the density at `value`.
    pub fn log_density(&self, value: f64) -> f64 {
        let logs = self.parts().map(|(mean, std)| {
            let z = (value - mean) / std;
            -0.5 * (z * z + TAU.ln()) - std.ln()
        });
        let logs: Vec<f64> = logs.collect();
        let largest = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logs.iter().map(|log| (log - largest).exp()).sum();
        largest + (sum / logs.len() as f64).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_parts_worked_by_hand() {
        let mixture = GaussianMixture::new(vec![-3.0, 3.0], &[1.0, 1.0]);
        assert!(mixture.mean().abs() < 1e-15);
        assert!((mixture.variance() - 10.0).abs() < 1e-14); // 1 + 9
        assert!((mixture.cdf(0.0) - 0.5).abs() < 1e-15);
        // Both parts have the density of N(0, 1) at 3 there.
        let expected = -4.5 - 0.5 * TAU.ln();
        assert!((mixture.log_density(0.0) - expected).abs() < 1e-14);
    }

    #[test]
    fn a_single_part_is_the_normal_distribution() {
        let mixture = GaussianMixture::new(vec![1.0], &[4.0]);
        // Φ⁻¹(0.975) = 1.959963984540054
        let upper = 1.0 + 2.0 * 1.959_963_984_540_054;
        assert!((mixture.cdf(upper) - 0.975).abs() < 1e-15);
    }

    #[test]
    fn a_target_far_from_every_part_still_has_a_log_density() {
        let mixture = GaussianMixture::new(vec![0.0, 1.0], &[1e-4, 1e-4]);
        // (100 − 1)/0.01 = 9900: exp(−9900²/2) is 0 in double precision.
        let expected = -0.5 * (9900.0_f64.powi(2) + TAU.ln()) - 0.01_f64.ln() - 2.0_f64.ln();
        let value = mixture.log_density(100.0);
        assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
    }
}
