//! The noise-free complete block with K^ρ integrated out: a matrix-variate t process.
//!
//! T (n, m) holds the torques of m contexts at the same n inputs, G = Tᵀ(K^x)⁻¹T. Under
//! [`TaskPrior`] with ν₀ and Ψ:
//!
//! ```text
//! K^ρ | T ~ inverse Wishart(ν₀ + n, Ψ + G)
//! log p(T | X, θ^x) = log Γ_m(½(ν₀ + n)) − log Γ_m(½ν₀) − ½nm log π − ½m log|K^x|
//!                     + ½ν₀ log|Ψ| − ½(ν₀ + n) log|Ψ + G|
//! t* | T ~ t_d(Tᵀ(K^x)⁻¹k*, c* (Ψ + G)/d),   d = ν₀ + n − m + 1,   c* = c(x*, x*) − k*ᵀ(K^x)⁻¹k*
//! ```
//! The means are those of eq. (18): integration does not bring transfer back, but it makes the
//! torques of the contexts at one input dependent, and their tails heavy.
//!
//! Source: sec. 5, the m-variate Student-t process; Gupta & Nagar 2000, *Matrix Variate
//! Distributions*, ch. 4; Conti & O'Hagan 2010 for the non-informative prior.

use std::f64::consts::PI;

use faer::Mat;
use kernels::Covariance;
use linalg::Factor;

use crate::error::{MtgpError, require_count};
use crate::noise_free::NoiseFreeBlock;
use crate::task_prior::{TaskPrior, log_multivariate_gamma};

/// A complete block without noise, averaged over K^ρ.
#[derive(Debug, Clone)]
pub struct IntegratedBlock<C> {
    block: NoiseFreeBlock<C>,
    prior: TaskPrior,
    /// Ψ + G, (m, m).
    scale: Mat<f64>,
    factor: Factor,
}

impl<C: Covariance> IntegratedBlock<C> {
    /// Averages a block over K^ρ.
    ///
    /// # Errors
    /// [`MtgpError::CountMismatch`] for a prior of another number of tasks;
    /// [`MtgpError::DependentContexts`] if Ψ + G is singular, which fewer inputs than contexts
    /// cause under the non-informative prior.
    pub fn new(block: NoiseFreeBlock<C>, prior: TaskPrior) -> Result<Self, MtgpError> {
        let m = block.n_tasks();
        require_count("tasks of the prior", prior.n_tasks(), m)?;
        let n = block.n_inputs() as f64;
        let g = block.k_task();
        let scale = Mat::from_fn(m, m, |row, col| {
            prior.scale()[(row, col)] + n * g[(row, col)]
        });
        let factor = if prior.degrees_of_freedom() > 0.0 {
            Factor::new(scale.clone())?
        } else {
            block.task_gram_factor()?
        };
        Ok(Self {
            block,
            prior,
            scale,
            factor,
        })
    }

    /// ν₀ + n.
    fn degrees_of_freedom(&self) -> f64 {
        self.prior.degrees_of_freedom() + self.block.n_inputs() as f64
    }

    /// log p(T | X, θ^x), natural logarithm.
    ///
    /// Under the non-informative prior, the integral of the likelihood times |K^ρ|^{−(m+1)/2}: good
    /// for comparing θ^x.
    pub fn log_marginal_likelihood(&self) -> f64 {
        let (n, m) = (self.block.n_inputs() as f64, self.block.n_tasks());
        let half = 0.5 * self.degrees_of_freedom();
        // 2^{(ν₀+n)m/2} of the posterior's constant against (2π)^{−nm/2} and the prior's 2^{−ν₀m/2}.
        let of_tasks = log_multivariate_gamma(half, m) - half * self.factor.log_det();
        let powers_of_two = half * m as f64 * std::f64::consts::LN_2;
        let of_inputs = -0.5 * m as f64 * (n * (2.0 * PI).ln() + self.block.input_log_det());
        of_tasks + powers_of_two + of_inputs + self.prior.log_constant()
    }

    /// The most probable K^ρ given T, (m, m).
    ///
    /// ```text
    /// (Ψ + G) / (ν₀ + n + m + 1)
    /// ```
    pub fn k_task_mode(&self) -> Mat<f64> {
        let m = self.block.n_tasks() as f64;
        (1.0 / (self.degrees_of_freedom() + m + 1.0)) * &self.scale
    }

    /// The torques of all contexts at one input.
    ///
    /// # Shapes
    /// `x` (d,).
    /// # Errors
    /// [`gp_core::GpError::WrongCovariates`] or [`gp_core::GpError::NonFiniteInput`].
    pub fn predict(&self, x: &[f64]) -> Result<StudentT, MtgpError> {
        let m = self.block.n_tasks();
        let row = Mat::from_fn(1, x.len(), |_, col| x[col]);
        let mut location = Vec::with_capacity(m);
        let mut left = 0.0;
        for task in 0..m {
            let prediction = self.block.predict(task, row.as_ref())?;
            location.push(prediction.mean[0]);
            if task == 0 {
                left = prediction.var[0] / self.block.k_task()[(0, 0)];
            }
        }
        let degrees_of_freedom = self.degrees_of_freedom() - m as f64 + 1.0;
        let scale = (left / degrees_of_freedom) * &self.scale;
        Ok(StudentT {
            degrees_of_freedom,
            location,
            scale,
        })
    }
}

/// A multivariate t distribution.
#[derive(Debug, Clone, PartialEq)]
pub struct StudentT {
    /// d.
    pub degrees_of_freedom: f64,
    /// Mean where d > 1, (m,).
    pub location: Vec<f64>,
    /// S, (m, m); the covariance is S d/(d − 2) where d > 2.
    pub scale: Mat<f64>,
}

impl StudentT {
    /// Natural logarithm of the density.
    ///
    /// ```text
    /// log Γ(½(d + m)) − log Γ(½d) − ½m log(πd) − ½ log|S| − ½(d + m) log(1 + δᵀS⁻¹δ/d)
    /// ```
    /// # Errors
    /// [`MtgpError::Gp`] if S is singular, as at an input that was trained on.
    /// # Panics
    /// If there are not m values.
    pub fn log_density(&self, values: &[f64]) -> Result<f64, MtgpError> {
        let (d, m) = (self.degrees_of_freedom, self.location.len());
        assert_eq!(values.len(), m);
        let deviation: Vec<f64> = (values.iter().zip(&self.location))
            .map(|(value, centre)| value - centre)
            .collect();
        let factor = Factor::new(self.scale.clone())?;
        let (distance, _) = factor.quadratic_form_and_solve(&deviation);
        let m = m as f64;
        let gammas = libm::lgamma(0.5 * (d + m)) - libm::lgamma(0.5 * d);
        let spread = m * (PI * d).ln() + factor.log_det();
        Ok(gammas - 0.5 * (spread + (d + m) * (distance / d).ln_1p()))
    }

    /// Marginal variances, (m,); infinite where d ≤ 2.
    pub fn variances(&self) -> Vec<f64> {
        let d = self.degrees_of_freedom;
        let factor = if d > 2.0 {
            d / (d - 2.0)
        } else {
            f64::INFINITY
        };
        let m = self.location.len();
        (0..m)
            .map(|task| factor * self.scale[(task, task)])
            .collect()
    }
}
