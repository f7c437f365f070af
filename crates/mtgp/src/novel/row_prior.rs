//! What the rows of the known tasks say of a row that has not been seen: a Gaussian.

use faer::Mat;
use linalg::Factor;

use crate::error::MtgpError;
use crate::latent::{LatentFunctions, PredictiveDensity};
use crate::prior::TaskRow;

/// A task drawn like the known ones.
///
/// ```text
/// λ ~ N(λ̄, V),   λ̄ = Σ_γ λ_γ/m,   V = (Σ_γ (λ_γ − λ̄)(λ_γ − λ̄)ᵀ + s²I)/m
/// ```
/// s² is the mean square of the deviations' entries, or of the entries themselves where no row
/// deviates: as if one more row had been seen a typical distance away in every direction, so that V
/// is positive definite for any number of rows.
/// # Shapes
/// m rows of r entries.
/// # Source
/// Section 5 of the chapter asks for priors over K^ρ; this is its empirical-Bayes form, a row at a
/// time (Gelman et al. 2013, *Bayesian Data Analysis*, sec. 5.1).
#[derive(Debug, Clone)]
pub struct RowPopulation {
    mean: Vec<f64>,
    covariance: Mat<f64>,
    factor: Factor,
}

impl RowPopulation {
    /// The population of which these rows are a sample.
    ///
    /// # Errors
    /// [`MtgpError::NoTasks`] without a row; [`MtgpError::CountMismatch`] or
    /// [`MtgpError::NonFinite`] unless they have the same number of finite entries;
    /// [`gp_core::GpError::NotPositiveDefinite`] if all entries are zero.
    pub fn of(rows: &[TaskRow]) -> Result<Self, MtgpError> {
        let rank = rows.first().ok_or(MtgpError::NoTasks)?.entries.len();
        for row in rows {
            row.require(rank)?;
        }
        let m = rows.len() as f64;
        let entries = |c: usize| rows.iter().map(move |row| row.entries[c]);
        let mean: Vec<f64> = (0..rank).map(|c| entries(c).sum::<f64>() / m).collect();
        let scatter = Mat::from_fn(rank, rank, |a, b| {
            let deviations = entries(a).zip(entries(b));
            let products = deviations.map(|(x, y)| (x - mean[a]) * (y - mean[b]));
            products.sum::<f64>()
        });
        let trace: f64 = (0..rank).map(|c| scatter[(c, c)]).sum();
        let squares: f64 = rows
            .iter()
            .flat_map(|row| &row.entries)
            .map(|e| e * e)
            .sum();
        let typical = if trace > 0.0 { trace } else { squares } / (m * rank as f64);
        let covariance = Mat::from_fn(rank, rank, |a, b| {
            (scatter[(a, b)] + if a == b { typical } else { 0.0 }) / m
        });
        Ok(Self {
            factor: Factor::new(covariance.clone())?,
            mean,
            covariance,
        })
    }

    /// λ̄, (r,).
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// V, (r, r).
    pub fn covariance(&self) -> &Mat<f64> {
        &self.covariance
    }

    /// log N(λ; λ̄, V) without its constant, and its gradient in λ, (r,).
    ///
    /// ```text
    /// −½ (λ − λ̄)ᵀV⁻¹(λ − λ̄),   −V⁻¹(λ − λ̄)
    /// ```
    pub(crate) fn log_density(&self, entries: &[f64]) -> (f64, Vec<f64>) {
        let deviation = entries
            .iter()
            .zip(&self.mean)
            .map(|(entry, mean)| entry - mean);
        let deviation: Vec<f64> = deviation.collect();
        let (squares, solved) = self.factor.quadratic_form_and_solve(&deviation);
        (-0.5 * squares, solved.iter().map(|slope| -slope).collect())
    }

    /// The density of new torques of a task drawn from the population, by its first two moments.
    ///
    /// ```text
    /// mean Mλ̄,   covariance Σ_cc′ (λ̄λ̄ᵀ + V)_cc′ S_cc′ + MVMᵀ + (σ² + noise²)I
    /// ```
    /// The moments are exact, the density is not Gaussian: the covariance depends on λ too.
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless there are r latent functions; as for
    /// [`PredictiveDensity::new`].
    pub fn density(
        &self,
        latent: &LatentFunctions,
        noise_std: f64,
    ) -> Result<PredictiveDensity, MtgpError> {
        let rank = latent.rank();
        TaskRow::in_span(self.mean.clone()).require(rank)?;
        let m = latent.mean();
        let mut sum = m * &self.covariance * m.transpose(); // (k, k)
        for c in 0..rank {
            for other in 0..rank {
                let moment = self.mean[c] * self.mean[other] + self.covariance[(c, other)];
                sum += faer::Scale(moment) * latent.covariance(c, other);
            }
        }
        let total = latent.noise_std().hypot(noise_std);
        PredictiveDensity::new(latent.mean_of(&self.mean), sum, total)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(values: &[[f64; 2]]) -> Vec<TaskRow> {
        let row = |value: &[f64; 2]| TaskRow::in_span(value.to_vec());
        values.iter().map(row).collect()
    }

    #[test]
    fn moments_of_two_rows_by_hand() {
        // Mean (1, 2), deviations ±(1, 0): scatter diag(2, 0), s² = 2/(2·2) = ½.
        let population = RowPopulation::of(&rows(&[[0.0, 2.0], [2.0, 2.0]])).unwrap();
        assert_eq!(population.mean(), [1.0, 2.0]);
        let v = population.covariance();
        let entries = [v[(0, 0)], v[(0, 1)], v[(1, 1)]].map(f64::to_bits);
        assert_eq!(entries, [1.25_f64, 0.0, 0.25].map(f64::to_bits)); // exact in binary
        // At (2, 3): −½ (1/1.25 + 1/0.25) = −2.4, slopes −0.8 and −4.
        let (value, slope) = population.log_density(&[2.0, 3.0]);
        assert!((value + 2.4).abs() <= 1e-15, "{value}");
        assert!((slope[0] + 0.8).abs() <= 1e-15 && (slope[1] + 4.0).abs() <= 1e-14);
    }

    #[test]
    fn equal_rows_spread_by_their_own_size_and_zeros_are_refused() {
        let population = RowPopulation::of(&rows(&[[1.0, 1.0]; 3])).unwrap();
        let v = population.covariance();
        // Σ e² = 6 over 3·2 entries: s² = 1, V = I/3.
        let entries = [v[(0, 0)], v[(0, 1)]].map(f64::to_bits);
        assert_eq!(entries, [1.0_f64 / 3.0, 0.0].map(f64::to_bits));
        assert!(RowPopulation::of(&rows(&[[0.0, 0.0]])).is_err());
        assert!(RowPopulation::of(&[]).is_err());
    }
}
