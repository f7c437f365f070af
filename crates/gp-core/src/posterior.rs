//! The posterior mean and variance of eqs. (3) and (4).

use faer::{Mat, MatRef};
use kernels::{Covariance, Jitter};
use linalg::Factor;

use crate::data::{require_finite_inputs, require_noise, require_training_data};
use crate::error::GpError;

/// Test points that are worked on together: bounds the memory to (n, `BLOCK`).
const BLOCK: usize = 128;

/// A Gaussian process conditioned on data.
///
/// ```text
/// mean(x*) = k*ᵀ α,   α = K⁻¹t          K = c(X, X) + σ²I,  k* = c(X, x*)
/// var(x*)  = c(x*, x*) − k*ᵀ K⁻¹ k*      of the noise-free (latent) torque
/// ```
/// Add σ² to the variance for that of a new observation.
/// # Source
/// Eqs. (3)–(4); Rasmussen & Williams 2006, algorithm 2.1.
#[derive(Debug, Clone)]
pub struct Posterior<C> {
    covariance: C,
    noise_std: f64,
    x: Mat<f64>,
    alpha: Vec<f64>,
    factor: Factor,
}

/// Posterior mean and latent variance at a set of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Posterior means, in target units.
    pub mean: Vec<f64>,
    /// Latent variances, in squared target units; never negative.
    pub var: Vec<f64>,
    /// How many variances came out below zero by rounding and were set to zero.
    pub n_clamped: usize,
}

impl<C: Covariance> Posterior<C> {
    /// Conditions a zero-mean process on data.
    ///
    /// # Shapes
    /// `x` (n, d); `targets` (n,).
    /// # Errors
    /// Data that is not finite or does not match, σ that is not positive, or K
    /// that is not positive definite.
    /// # Panics
    /// If `x` does not have the number of columns that the covariance needs.
    pub fn new(
        covariance: C,
        noise_std: f64,
        x: MatRef<'_, f64>,
        targets: &[f64],
    ) -> Result<Self, GpError> {
        require_training_data(x, targets, 1)?;
        require_noise(noise_std)?;
        let mut k_xx = Mat::zeros(x.nrows(), x.nrows());
        covariance.add_gram(x, k_xx.as_mut());
        Jitter::new(noise_std)?.add_gram(x, k_xx.as_mut());

        let factor = Factor::new(k_xx)?;
        let alpha = factor.solve(targets);
        Ok(Self {
            covariance,
            noise_std,
            x: x.to_owned(),
            alpha,
            factor,
        })
    }

    /// The posterior with given parts, as a model file holds them.
    ///
    /// # Panics
    /// If the shapes do not agree.
    pub(crate) fn from_parts(
        covariance: C,
        noise_std: f64,
        x: Mat<f64>,
        alpha: Vec<f64>,
        factor: Factor,
    ) -> Self {
        assert_eq!(alpha.len(), x.nrows());
        assert_eq!(factor.order(), x.nrows());
        Self {
            covariance,
            noise_std,
            x,
            alpha,
            factor,
        }
    }

    pub(crate) fn with_covariance<D: Covariance>(&self, covariance: D) -> Posterior<D> {
        Posterior {
            covariance,
            noise_std: self.noise_std,
            x: self.x.clone(),
            alpha: self.alpha.clone(),
            factor: self.factor.clone(),
        }
    }

    /// The covariance function c.
    pub fn covariance(&self) -> &C {
        &self.covariance
    }

    /// Noise standard deviation σ, in target units.
    pub fn noise_std(&self) -> f64 {
        self.noise_std
    }

    /// Training inputs, (n, d).
    pub fn x(&self) -> MatRef<'_, f64> {
        self.x.as_ref()
    }

    /// α = K⁻¹t, (n,).
    pub fn alpha(&self) -> &[f64] {
        &self.alpha
    }

    /// The factor of K = c(X, X) + σ²I.
    pub fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Posterior means at the rows of `x`, in target units.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let mut means = Vec::with_capacity(x.nrows());
        self.for_each_block(x, |_, k_xs| means.extend(self.means_from(k_xs)))?;
        Ok(means)
    }

    /// Posterior variances of the latent torque at the rows of `x`, at least zero.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_var(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        Ok(self.predict(x)?.var)
    }

    /// Posterior means and latent variances at the rows of `x`.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict(&self, x: MatRef<'_, f64>) -> Result<Prediction, GpError> {
        let mut mean = Vec::with_capacity(x.nrows());
        let mut var = Vec::with_capacity(x.nrows());
        self.for_each_block(x, |x_block, k_xs| {
            mean.extend(self.means_from(k_xs));
            let prior = self.covariance.diag(x_block);
            self.factor.half_solve_in_place(k_xs.as_mut());
            let explained = (0..k_xs.ncols()).map(|col| squared_norm(k_xs.col_as_slice(col)));
            var.extend(
                prior
                    .iter()
                    .zip(explained)
                    .map(|(prior, part)| prior - part),
            );
        })?;

        let mut n_clamped = 0;
        for value in var.iter_mut().filter(|value| **value < 0.0) {
            *value = 0.0;
            n_clamped += 1;
        }
        Ok(Prediction {
            mean,
            var,
            n_clamped,
        })
    }

    /// k*ᵀα for every column k* of a block.
    fn means_from(&self, k_xs: &Mat<f64>) -> Vec<f64> {
        (0..k_xs.ncols())
            .map(|col| dot(k_xs.col_as_slice(col), &self.alpha))
            .collect()
    }

    /// Visits the test points in blocks, with c(X, X*) of each, (n, block).
    fn for_each_block(
        &self,
        x: MatRef<'_, f64>,
        mut visit: impl FnMut(MatRef<'_, f64>, &mut Mat<f64>),
    ) -> Result<(), GpError> {
        if x.ncols() != self.x.ncols() {
            return Err(GpError::WrongCovariates {
                found: x.ncols(),
                expected: self.x.ncols(),
            });
        }
        require_finite_inputs(x)?;
        let mut k_xs = Mat::zeros(self.x.nrows(), BLOCK.min(x.nrows()));
        for first in (0..x.nrows()).step_by(BLOCK) {
            let x_block = x.subrows(first, BLOCK.min(x.nrows() - first));
            if x_block.nrows() == k_xs.ncols() {
                k_xs.fill(0.0);
            } else {
                k_xs = Mat::zeros(self.x.nrows(), x_block.nrows());
            }
            self.covariance
                .add_cross(self.x.as_ref(), x_block, k_xs.as_mut());
            visit(x_block, &mut k_xs);
        }
        Ok(())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn squared_norm(values: &[f64]) -> f64 {
    dot(values, values)
}
