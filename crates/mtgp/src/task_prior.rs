//! Priors of the covariance between tasks, K^ρ.
//!
//! ```text
//! non-informative    p(K^ρ) ∝ |K^ρ|^{−(m+1)/2}
//! inverse Wishart    p(K^ρ) ∝ |K^ρ|^{−(ν₀+m+1)/2} exp(−½ tr Ψ(K^ρ)⁻¹)
//! ```
//! Both are densities of symmetric positive definite matrices; a K^ρ of a lower rank than m has none.
//! The first is the second at ν₀ = 0, Ψ = 0; it cannot be normalised.
//!
//! Source: sec. 5; Gelman et al. 2013, *Bayesian Data Analysis*, 3rd ed., sec. 3.6.

use std::f64::consts::{LN_2, PI};

use faer::{Mat, MatRef};
use gp_core::{Evaluation, GpError, Likelihood};
use kernels::Covariance;
use linalg::Factor;

use crate::error::MtgpError;
use crate::prior::MultiTaskCovariance;
use crate::task_cov::TaskCovariance;

/// A prior of K^ρ.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskPrior {
    /// ν₀.
    degrees_of_freedom: f64,
    /// Ψ, (m, m).
    scale: Mat<f64>,
    /// Logarithm of the constant in front; 0 where there is none.
    log_constant: f64,
}

impl TaskPrior {
    /// |K^ρ|^{−(m+1)/2}, for m tasks; not normalised, as it cannot be.
    pub fn non_informative(n_tasks: usize) -> Self {
        Self {
            degrees_of_freedom: 0.0,
            scale: Mat::zeros(n_tasks, n_tasks),
            log_constant: 0.0,
        }
    }

    /// The inverse Wishart distribution; its mean is Ψ/(ν₀ − m − 1) where ν₀ > m + 1.
    ///
    /// ```text
    /// |Ψ|^{ν₀/2} / (2^{ν₀m/2} Γ_m(ν₀/2)) |K^ρ|^{−(ν₀+m+1)/2} exp(−½ tr Ψ(K^ρ)⁻¹)
    /// ```
    /// # Shapes
    /// `scale` Ψ, (m, m), read below its diagonal.
    /// # Errors
    /// [`MtgpError::NoTasks`]; [`MtgpError::ImproperTaskPrior`] unless ν₀ > m − 1; [`MtgpError::Gp`]
    /// unless Ψ is positive definite.
    /// # Panics
    /// If Ψ is not square.
    pub fn inverse_wishart(
        degrees_of_freedom: f64,
        scale: MatRef<'_, f64>,
    ) -> Result<Self, MtgpError> {
        let n_tasks = scale.nrows();
        if n_tasks == 0 {
            return Err(MtgpError::NoTasks);
        }
        let m = n_tasks as f64;
        if !(degrees_of_freedom.is_finite() && degrees_of_freedom > m - 1.0) {
            return Err(MtgpError::ImproperTaskPrior {
                degrees_of_freedom,
                n_tasks,
            });
        }
        let log_det = Factor::new(scale.to_owned())?.log_det();
        let half = 0.5 * degrees_of_freedom;
        let log_constant = half * (log_det - m * LN_2) - log_multivariate_gamma(half, n_tasks);
        Ok(Self {
            degrees_of_freedom,
            scale: Mat::from_fn(n_tasks, n_tasks, |row, col| {
                scale[(row.max(col), row.min(col))]
            }),
            log_constant,
        })
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.scale.nrows()
    }

    /// ν₀; 0 for the non-informative prior.
    pub fn degrees_of_freedom(&self) -> f64 {
        self.degrees_of_freedom
    }

    /// Ψ, (m, m); zeros for the non-informative prior.
    pub fn scale(&self) -> MatRef<'_, f64> {
        self.scale.as_ref()
    }

    pub(crate) fn log_constant(&self) -> f64 {
        self.log_constant
    }

    /// (ν₀ + m + 1)/2, the power of 1/|K^ρ|.
    fn power(&self) -> f64 {
        0.5 * (self.degrees_of_freedom + self.n_tasks() as f64 + 1.0)
    }

    /// log p(K^ρ), natural logarithm; up to its constant for the non-informative prior.
    ///
    /// # Errors
    /// [`MtgpError::Gp`] unless K^ρ is positive definite.
    /// # Panics
    /// If `k_task` is not (m, m).
    pub fn log_density(&self, k_task: MatRef<'_, f64>) -> Result<f64, MtgpError> {
        Ok(self.with_derivative(k_task)?.0)
    }

    /// log p(K^ρ) with its symmetric derivative, (m, m).
    ///
    /// ```text
    /// ∂ log p = tr(S ∂K^ρ),   S = ½ K⁻¹ΨK⁻¹ − ½ (ν₀ + m + 1) K⁻¹
    /// ```
    fn with_derivative(&self, k_task: MatRef<'_, f64>) -> Result<(f64, Mat<f64>), GpError> {
        let m = self.n_tasks();
        assert_eq!((k_task.nrows(), k_task.ncols()), (m, m));
        let factor = Factor::new(k_task.to_owned())?;
        let mut inverse = Mat::identity(m, m);
        factor.solve_in_place(inverse.as_mut());
        let mut inner = self.scale.clone();
        factor.solve_in_place(inner.as_mut()); // K⁻¹Ψ
        let trace: f64 = (0..m).map(|task| inner[(task, task)]).sum();
        factor.solve_in_place(inner.as_mut().transpose_mut()); // K⁻¹ΨK⁻¹
        let slope = Mat::from_fn(m, m, |row, col| {
            let (a, b) = (row.max(col), row.min(col));
            0.5 * inner[(a, b)] - self.power() * inverse[(a, b)]
        });
        let value = self.log_constant - self.power() * factor.log_det() - 0.5 * trace;
        Ok((value, slope))
    }
}

/// Which variable a prior of K^ρ = ΛΛᵀ is a density of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TaskMeasure {
    /// K^ρ itself: what its most probable value is to maximise.
    Matrix,
    /// The free entries of Λ: what a sampler that moves in Λ draws from.
    ///
    /// ```text
    /// p(Λ) = p(K^ρ) |∂K^ρ/∂Λ|,    |∂K^ρ/∂Λ| = 2^m Π_i |Λ_ii|^{m+1−i},   i = 1 … m
    /// ```
    /// Source: Muirhead 1982, *Aspects of Multivariate Statistical Theory*, theorem 2.1.9.
    Factor,
}

/// A likelihood times a prior of K^ρ, as something to climb or to sample.
///
/// With [`gp_core::search`] it gives the most probable hyperparameters instead of the likeliest;
/// with [`gp_core::sampling::HyperPosterior`], chains.
/// Λ must have full rank m, and K^ρ must be of the kind [`TaskCovariance::Factor`].
#[derive(Debug, Clone)]
pub struct WithTaskPrior<L> {
    likelihood: L,
    prior: TaskPrior,
    measure: TaskMeasure,
}

impl<L: Likelihood<MultiTaskCovariance>> WithTaskPrior<L> {
    /// p(t | X, θ, Λ, σ) p(Λ Λᵀ).
    pub fn new(likelihood: L, prior: TaskPrior, measure: TaskMeasure) -> Self {
        Self {
            likelihood,
            prior,
            measure,
        }
    }
}

impl<L: Likelihood<MultiTaskCovariance>> Likelihood<MultiTaskCovariance> for WithTaskPrior<L> {
    /// The value is that of the likelihood times the prior; its other entries are the likelihood's.
    ///
    /// # Errors
    /// Those of the likelihood; [`GpError::NotPositiveDefinite`] if Λ does not have full rank.
    /// # Panics
    /// If the prior is for another number of tasks.
    fn evaluate(
        &mut self,
        covariance: &MultiTaskCovariance,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError> {
        let task = covariance.task();
        let (log_prior, slope) = self.prior.with_derivative(task.k_task().as_ref())?;
        let mut evaluation = (self.likelihood).evaluate(covariance, noise_std, gradient)?;
        let first = covariance.input().n_params();
        let of_task = &mut gradient[first..first + task.n_params()];
        task.add_adjoint(slope.as_ref(), of_task);
        evaluation.log_marginal_likelihood += log_prior;
        if self.measure == TaskMeasure::Factor {
            evaluation.log_marginal_likelihood += add_log_jacobian(task, of_task);
        }
        Ok(evaluation)
    }

    fn parts(&self) -> Vec<MatRef<'_, f64>> {
        self.likelihood.parts()
    }
}

/// log |∂K^ρ/∂Λ|, with its slopes (m + 1 − i)/Λ_ii added to those of the free entries.
fn add_log_jacobian(task: &TaskCovariance, gradient: &mut [f64]) -> f64 {
    let TaskCovariance::Factor(factor) = task else {
        return 0.0;
    };
    let m = factor.n_tasks();
    let mut value = m as f64 * LN_2;
    let mut idx = 0;
    for row in 0..m {
        idx += row; // free entries stand row by row, the diagonal last
        let power = (m - row) as f64;
        let entry = factor.lambda()[(row, row)];
        value += power * entry.abs().ln();
        gradient[idx] += power / entry;
        idx += 1;
    }
    value
}

/// log Γ_m(a), the multivariate gamma function.
///
/// ```text
/// Γ_m(a) = π^{m(m−1)/4} Π_{i=1}^m Γ(a + (1 − i)/2)
/// ```
pub(crate) fn log_multivariate_gamma(a: f64, m: usize) -> f64 {
    let gammas: f64 = (0..m).map(|i| libm::lgamma(a - 0.5 * i as f64)).sum();
    let pairs = (m * m.saturating_sub(1)) as f64;
    0.25 * pairs * PI.ln() + gammas
}
