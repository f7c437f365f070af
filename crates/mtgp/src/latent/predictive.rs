//! The joint predictive density of several new torques of one joint under one context.

use faer::{ColMut, Mat, MatRef};
use gp_core::{GpError, Posterior};
use kernels::Covariance;
use linalg::Factor;

use crate::error::{MtgpError, require_count};

/// A Gaussian density of k torques that will be observed together.
///
/// ```text
/// N(mean, Σ + σ²I),   LLᵀ = Σ + σ²I
/// ```
/// Σ is the posterior covariance of the latent torques, σ the noise of one observation.
/// # Source
/// Eqs. (3)–(4) in matrix form; Rasmussen & Williams 2006, eqs. (2.22)–(2.24).
#[derive(Debug, Clone)]
pub struct PredictiveDensity {
    mean: Vec<f64>,
    factor: Factor,
}

impl PredictiveDensity {
    /// The density with given latent mean and covariance.
    ///
    /// # Shapes
    /// `mean` (k,); `latent_covariance` (k, k), read below its diagonal.
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] unless Σ + σ²I has a Cholesky factor.
    /// # Panics
    /// If the shapes do not agree.
    pub fn new(
        mean: Vec<f64>,
        mut latent_covariance: Mat<f64>,
        noise_std: f64,
    ) -> Result<Self, MtgpError> {
        assert_eq!(mean.len(), latent_covariance.nrows());
        for idx in 0..mean.len() {
            latent_covariance[(idx, idx)] += noise_std * noise_std;
        }
        let factor = Factor::new(latent_covariance)?;
        Ok(Self { mean, factor })
    }

    /// The density that a posterior gives to new torques at the rows of `x`.
    ///
    /// # Errors
    /// As for [`Posterior::predict_covariance`], and as for [`PredictiveDensity::new`].
    pub fn of_posterior<C: Covariance>(
        posterior: &Posterior<C>,
        x: MatRef<'_, f64>,
    ) -> Result<Self, MtgpError> {
        let mean = posterior.predict_mean(x)?;
        let covariance = posterior.predict_covariance(x)?;
        Self::new(mean, covariance, posterior.noise_std())
    }

    /// Number of torques k.
    pub fn n_torques(&self) -> usize {
        self.mean.len()
    }

    /// Means, (k,).
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The factor L of Σ + σ²I, (k, k).
    pub fn factor(&self) -> &Factor {
        &self.factor
    }

    /// The whitened residuals, (k,): independent standard normal numbers if the density is right.
    ///
    /// ```text
    /// z = L⁻¹ (t − mean)
    /// ```
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless there are k torques;
    /// [`GpError::NonFiniteTarget`] for one that is NaN or infinite.
    pub fn whitened(&self, torques: &[f64]) -> Result<Vec<f64>, MtgpError> {
        require_torques(torques, self.n_torques())?;
        let mut residuals: Vec<f64> = (torques.iter().zip(&self.mean))
            .map(|(torque, mean)| torque - mean)
            .collect();
        let column = ColMut::from_slice_mut(&mut residuals).as_mat_mut();
        self.factor.half_solve_in_place(column);
        Ok(residuals)
    }

    /// Natural logarithm of the density at `torques`, with the sum of their squares |z|².
    ///
    /// ```text
    /// log N(t; mean, LLᵀ) = −½ |z|² − Σ_i log L_ii − (k/2) log 2π
    /// ```
    /// # Errors
    /// As for [`PredictiveDensity::whitened`].
    pub fn log_density(&self, torques: &[f64]) -> Result<(f64, f64), MtgpError> {
        let squares: f64 = self.whitened(torques)?.iter().map(|z| z * z).sum();
        let constant = self.n_torques() as f64 * std::f64::consts::TAU.ln();
        let value = -0.5 * (squares + self.factor.log_det() + constant);
        Ok((value, squares))
    }

    /// Log density of the first torque, of the first two, …, each with the sum of its squares, (k,).
    ///
    /// ```text
    /// log p(t_1, …, t_j) = Σ_{i ≤ j} (−½ z_i² − log L_ii − ½ log 2π)
    /// ```
    /// as the leading part of a Cholesky factor is the factor of the leading part: a growing
    /// number of torques is judged at the cost of all of them.
    /// # Errors
    /// As for [`PredictiveDensity::whitened`].
    pub fn running_log_densities(&self, torques: &[f64]) -> Result<Vec<(f64, f64)>, MtgpError> {
        let whitened = self.whitened(torques)?;
        let half_log_tau = 0.5 * std::f64::consts::TAU.ln();
        let l = self.factor.l();
        let mut sums = (0.0, 0.0);
        let running = whitened.iter().enumerate().map(|(idx, z)| {
            sums.0 -= 0.5 * z * z + l[(idx, idx)].ln() + half_log_tau;
            sums.1 += z * z;
            sums
        });
        Ok(running.collect())
    }
}

/// Fails unless there are `expected` torques, all of them finite.
pub(crate) fn require_torques(torques: &[f64], expected: usize) -> Result<(), MtgpError> {
    require_count("new torques of a joint", torques.len(), expected)?;
    match torques.iter().position(|torque| !torque.is_finite()) {
        None => Ok(()),
        Some(row) => Err(GpError::NonFiniteTarget {
            row,
            value: torques[row],
        })?,
    }
}
