//! The log marginal likelihood of eq. (8) and its gradient.

use std::f64::consts::PI;

use faer::{Mat, MatRef};
use kernels::{Covariance, Jitter};

use crate::cholesky::Factor;
use crate::data::{require_noise, require_training_data};
use crate::error::GpError;

/// Log marginal likelihood of the targets under a zero-mean Gaussian process.
///
/// ```text
/// log p(t | X, θ) = −½ tᵀK⁻¹t − ½ log|K| − ½ n log 2π      K = c(X, X) + σ²I
/// ```
/// Natural logarithm, summed over the data.
/// # Shapes
/// `x` (n, d); `targets` (n,).
/// # Errors
/// Data that is not finite or does not match, σ that is not positive, K that is
/// not positive definite, or a value that overflows.
/// # Panics
/// If `x` does not have the number of columns that the covariance needs.
/// # Source
/// Eq. (8); Rasmussen & Williams 2006, algorithm 2.1.
pub fn log_marginal_likelihood<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    x: MatRef<'_, f64>,
    targets: &[f64],
) -> Result<f64, GpError> {
    require_training_data(x, targets, 1)?;
    require_noise(noise_std)?;
    LogMarginal::new(x, targets).value(covariance, noise_std)
}

/// Log marginal likelihood and its gradient with respect to every hyperparameter.
///
/// The gradient is with respect to natural parameters (standard deviations and
/// length scales), in the order of the covariance's layout, σ last.
/// ```text
/// ∂/∂θ_i log p = tr(QᵀK_i),   Q = ½(αα′ − K⁻¹),   α = K⁻¹t,   K_i = ∂K/∂θ_i
/// ```
/// # Errors
/// As for [`log_marginal_likelihood`].
/// # Panics
/// If `x` does not have the number of columns that the covariance needs.
/// # Source
/// Eq. (8); Rasmussen & Williams 2006, eq. (5.9).
pub fn log_marginal_likelihood_with_gradient<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    x: MatRef<'_, f64>,
    targets: &[f64],
) -> Result<(f64, Vec<f64>), GpError> {
    require_training_data(x, targets, 1)?;
    require_noise(noise_std)?;
    let mut gradient = vec![0.0; covariance.n_params() + 1];
    let value =
        LogMarginal::new(x, targets).value_and_gradient(covariance, noise_std, &mut gradient)?;
    Ok((value, gradient))
}

/// Eq. (8) on one data set, with memory that later evaluations use again.
///
/// Peak memory is two (n, n) matrices.
#[derive(Debug)]
pub struct LogMarginal<'a> {
    x: MatRef<'a, f64>,
    targets: &'a [f64],
    gram: Mat<f64>,
    scratch: Mat<f64>,
}

impl<'a> LogMarginal<'a> {
    /// The likelihood of these targets; allocates nothing yet.
    ///
    /// # Panics
    /// If there is not one target per row of `x`.
    pub fn new(x: MatRef<'a, f64>, targets: &'a [f64]) -> Self {
        assert_eq!(x.nrows(), targets.len());
        Self {
            x,
            targets,
            gram: Mat::new(),
            scratch: Mat::new(),
        }
    }

    /// The inputs, (n, d).
    pub fn x(&self) -> MatRef<'a, f64> {
        self.x
    }

    /// The value of eq. (8).
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] or [`GpError::NonFiniteLikelihood`].
    pub fn value<C: Covariance>(&mut self, covariance: &C, noise_std: f64) -> Result<f64, GpError> {
        let factor = self.factorise(covariance, noise_std)?;
        let (quadratic, _) = factor.quadratic_form_and_solve(self.targets);
        let value = log_density(quadratic, &factor);
        self.gram = factor.into_buffer();
        self.require_finite(value)
    }

    /// The value of eq. (8) and its gradient with respect to (θ, σ).
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] or [`GpError::NonFiniteLikelihood`].
    /// # Panics
    /// If `gradient` does not have one entry per hyperparameter and one for σ.
    pub fn value_and_gradient<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<f64, GpError> {
        let n_params = covariance.n_params();
        assert_eq!(gradient.len(), n_params + 1);
        let factor = self.factorise(covariance, noise_std)?;
        let (quadratic, alpha) = factor.quadratic_form_and_solve(self.targets);
        let value = log_density(quadratic, &factor);

        let n = self.targets.len();
        if self.scratch.nrows() != n {
            self.scratch = Mat::zeros(n, n);
        }
        let mut adjoint = factor.into_inverse(&mut self.scratch); // (n, n), lower
        half_outer_minus_half(&mut adjoint, &alpha);

        gradient.fill(0.0);
        let (of_theta, of_noise) = gradient.split_at_mut(n_params);
        covariance.gram_adjoint(self.x, adjoint.as_ref(), of_theta);
        Jitter::new(noise_std)?.gram_adjoint(self.x, adjoint.as_ref(), of_noise);
        self.gram = adjoint;

        let gradient_sum: f64 = gradient.iter().sum();
        self.require_finite(gradient_sum)?;
        self.require_finite(value)
    }

    /// The factor of K = c(X, X) + σ²I, in the memory of `gram`.
    fn factorise<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
    ) -> Result<Factor, GpError> {
        let n = self.targets.len();
        let mut gram = std::mem::replace(&mut self.gram, Mat::new());
        if gram.nrows() == n {
            gram.fill(0.0);
        } else {
            gram = Mat::zeros(n, n);
        }
        covariance.add_gram(self.x, gram.as_mut());
        Jitter::new(noise_std)?.add_gram(self.x, gram.as_mut());
        Factor::new(gram)
    }

    fn require_finite(&self, value: f64) -> Result<f64, GpError> {
        if value.is_finite() {
            return Ok(value);
        }
        Err(GpError::NonFiniteLikelihood {
            n_samples: self.targets.len(),
        })
    }
}

/// −½ tᵀK⁻¹t − ½ log|K| − ½ n log 2π.
fn log_density(quadratic: f64, factor: &Factor) -> f64 {
    let n = factor.order() as f64;
    -0.5 * quadratic - 0.5 * factor.log_det() - 0.5 * n * (2.0 * PI).ln()
}

/// Turns the lower triangle of K⁻¹ into that of ½(αα′ − K⁻¹).
fn half_outer_minus_half(inverse: &mut Mat<f64>, alpha: &[f64]) {
    for (col, alpha_col) in alpha.iter().enumerate() {
        let column = &mut inverse.col_as_slice_mut(col)[col..];
        for (entry, alpha_row) in column.iter_mut().zip(&alpha[col..]) {
            *entry = 0.5 * (alpha_row * alpha_col - *entry);
        }
    }
}
