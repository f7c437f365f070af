//! The noise-free complete block: its likelihood in θ^x alone, and K^ρ in closed form.
//!
//! T (ν, m) holds the torques of m contexts at the same ν inputs, without noise. With
//! G = Tᵀ(K^x)⁻¹T, (m, m):
//!
//! ```text
//! L(θ^x, K^ρ) = −½ν log|K^ρ| − ½m log|K^x| − ½ tr(G (K^ρ)⁻¹) − ½mν log 2π          (23)
//! ∂L/∂K^ρ = −½ν (K^ρ)⁻¹ + ½ (K^ρ)⁻¹ G (K^ρ)⁻¹                                      (24)
//! K^ρ(θ^x) = G/ν                                                                   (25)
//! L(θ^x, K^ρ(θ^x)) = −½ν log|G/ν| − ½m log|K^x| − ½mν (1 + log 2π)                 (26)
//! ∂/∂θ^x of (26) = tr(Q ∂K^x),   Q = ½ (ν B G⁻¹ Bᵀ − m (K^x)⁻¹),   B = (K^x)⁻¹T
//! ```
//! (26) does not change when c^x is multiplied by a constant: K^ρ is divided by it.
//!
//! A context's predictions use its own torques only (eq. (18)): there is no transfer. That is what
//! makes this case of theoretical rather than practical use; with noise see [`crate::block::CompleteBlock`].
//!
//! G is singular if the contexts' torques are linearly dependent at the inputs, which is certain with
//! more contexts than inputs; K^ρ then has no inverse and the likelihood has no maximum.
//!
//! Source: sec. 4.3.1, eq. (18); appendix A.2, eqs. (23)–(26).

use std::f64::consts::PI;

use faer::{Mat, MatRef};
use gp_core::Prediction;
use kernels::Covariance;
use linalg::sums::dot_in_sequence;
use linalg::{Factor, product, thin_svd};

use crate::block::complete_block::require_block;
use crate::block::prediction::TaskPosterior;
use crate::error::MtgpError;

/// A multi-task process conditioned on a complete block without noise.
///
/// # Source
/// Eqs. (18) and (23)–(26).
#[derive(Debug, Clone)]
pub struct NoiseFreeBlock<C> {
    covariance: C,
    x: Mat<f64>,
    /// Of K^x, (ν, ν).
    factor: Factor,
    /// L⁻¹T for K^x = LLᵀ, (ν, m).
    half_solved: Mat<f64>,
    /// B = (K^x)⁻¹T, (ν, m).
    weights: Mat<f64>,
    /// G = Tᵀ(K^x)⁻¹T, (m, m).
    task_gram: Mat<f64>,
}

impl<C: Covariance> NoiseFreeBlock<C> {
    /// Conditions on the exact torques of every context at the same inputs.
    ///
    /// # Shapes
    /// `x` (ν, d), distinct rows; `targets` T (ν, m).
    /// # Errors
    /// [`gp_core::GpError`] for data that is missing or not finite, and for K^x without a Cholesky
    /// factor, which equal or nearly equal inputs cause.
    /// # Panics
    /// If shapes do not agree, or `x` does not have the columns that the covariance needs.
    pub fn new(
        covariance: C,
        x: MatRef<'_, f64>,
        targets: MatRef<'_, f64>,
    ) -> Result<Self, MtgpError> {
        require_block(x, targets)?;
        let factor = Factor::new(covariance.gram(x))?;
        let mut half_solved = targets.to_owned();
        factor.half_solve_in_place(half_solved.as_mut());
        let mut weights = targets.to_owned();
        factor.solve_in_place(weights.as_mut());
        let task_gram = product(half_solved.transpose(), half_solved.as_ref());
        Ok(Self {
            covariance,
            x: x.to_owned(),
            factor,
            half_solved,
            weights,
            task_gram,
        })
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.task_gram.nrows()
    }

    /// Number of inputs ν.
    pub fn n_inputs(&self) -> usize {
        self.x.nrows()
    }

    /// K^ρ at the maximum of the likelihood, (m, m); also where it is singular.
    ///
    /// ```text
    /// K^ρ = Tᵀ(K^x)⁻¹T / ν
    /// ```
    /// # Source
    /// Eq. (25).
    pub fn k_task(&self) -> Mat<f64> {
        (1.0 / self.n_inputs() as f64) * &self.task_gram
    }

    /// The log marginal likelihood at a given K^ρ, natural log.
    ///
    /// # Errors
    /// [`gp_core::GpError::NotPositiveDefinite`] if `k_task` is singular.
    /// # Panics
    /// If `k_task` is not (m, m).
    /// # Source
    /// Eq. (23).
    pub fn log_marginal_likelihood(&self, k_task: MatRef<'_, f64>) -> Result<f64, MtgpError> {
        let (n_inputs, m) = (self.n_inputs() as f64, self.n_tasks() as f64);
        let of_tasks = Factor::new(k_task.to_owned())?;
        // tr(G (K^ρ)⁻¹) = |L_ρ⁻¹ (L⁻¹T)ᵀ|², a sum of squares.
        let mut whitened = self.half_solved.transpose().to_owned(); // (m, ν)
        of_tasks.half_solve_in_place(whitened.as_mut());
        let quadratic = whitened.squared_norm_l2();
        let log_dets = n_inputs * of_tasks.log_det() + m * self.factor.log_det();
        Ok(-0.5 * (log_dets + quadratic + m * n_inputs * (2.0 * PI).ln()))
    }

    /// The symmetric derivative of the likelihood with respect to K^ρ, (m, m).
    ///
    /// ```text
    /// ∂L = tr(Q^ρ ∂K^ρ),    Q^ρ = ½ ((K^ρ)⁻¹ G (K^ρ)⁻¹ − ν (K^ρ)⁻¹)
    /// ```
    /// # Errors
    /// [`gp_core::GpError::NotPositiveDefinite`] if `k_task` is singular.
    /// # Panics
    /// If `k_task` is not (m, m).
    /// # Source
    /// Eq. (24).
    pub fn k_task_gradient(&self, k_task: MatRef<'_, f64>) -> Result<Mat<f64>, MtgpError> {
        let (n_inputs, m) = (self.n_inputs() as f64, self.n_tasks());
        let of_tasks = Factor::new(k_task.to_owned())?;
        // (K^ρ)⁻¹ (G − νK^ρ) (K^ρ)⁻¹: a difference of matrices before it is magnified.
        let mut inner = Mat::from_fn(m, m, |row, col| {
            0.5 * (self.task_gram[(row, col)] - n_inputs * k_task[(row, col)])
        });
        of_tasks.solve_in_place(inner.as_mut());
        of_tasks.solve_in_place(inner.as_mut().transpose_mut());
        Ok(inner)
    }

    /// The log marginal likelihood at its maximum over K^ρ, natural log.
    ///
    /// # Errors
    /// [`MtgpError::DependentContexts`] if G is singular to working precision.
    /// # Source
    /// Eq. (26); up to constants it is half of eq. (18)'s −m log|K^x| − ν log|Tᵀ(K^x)⁻¹T|, sec. 4.3.1.
    pub fn profile_log_marginal_likelihood(&self) -> Result<f64, MtgpError> {
        let (n_inputs, m) = (self.n_inputs() as f64, self.n_tasks() as f64);
        let log_det_k_task = self.task_gram_factor()?.log_det() - m * n_inputs.ln();
        let log_dets = n_inputs * log_det_k_task + m * self.factor.log_det();
        Ok(-0.5 * (log_dets + m * n_inputs * (1.0 + (2.0 * PI).ln())))
    }

    /// Gradient of [`Self::profile_log_marginal_likelihood`] with respect to θ^x.
    ///
    /// # Errors
    /// [`MtgpError::DependentContexts`] if G is singular to working precision.
    pub fn profile_gradient(&self) -> Result<Vec<f64>, MtgpError> {
        let (n_inputs, m) = (self.n_inputs(), self.n_tasks() as f64);
        // B G⁻¹ Bᵀ = (B L_G⁻ᵀ)(B L_G⁻ᵀ)ᵀ
        let mut whitened = self.weights.clone(); // (ν, m)
        self.task_gram_factor()?
            .half_solve_in_place(whitened.as_mut().transpose_mut());
        let outer = product(whitened.as_ref(), whitened.transpose()); // (ν, ν)
        let inverse = (self.factor.clone()).into_inverse(&mut Mat::zeros(n_inputs, n_inputs));
        let adjoint = Mat::from_fn(n_inputs, n_inputs, |row, col| {
            let (row, col) = (row.max(col), row.min(col)); // the inverse is a lower triangle
            0.5 * (n_inputs as f64 * outer[(row, col)] - m * inverse[(row, col)])
        });
        let mut gradient = vec![0.0; self.covariance.n_params()];
        self.covariance
            .gram_adjoint(self.x.as_ref(), adjoint.as_ref(), &mut gradient);
        Ok(gradient)
    }

    /// Posterior mean and variance of one context's torque at the rows of `x_test`.
    ///
    /// ```text
    /// mean = k*ᵀ(K^x)⁻¹t^γ         var = (K^ρ)_γγ (c^x(x*, x*) − k*ᵀ(K^x)⁻¹k*)
    /// ```
    /// K^ρ is that of eq. (25); the mean does not depend on it, nor on the other contexts.
    /// # Errors
    /// [`gp_core::GpError::WrongCovariates`] or [`gp_core::GpError::NonFiniteInput`].
    /// # Panics
    /// If there is no such task.
    /// # Source
    /// Eq. (18).
    pub fn predict(&self, task: usize, x_test: MatRef<'_, f64>) -> Result<Prediction, MtgpError> {
        let prior_scale = self.task_gram[(task, task)] / self.n_inputs() as f64;
        let posterior = TaskPosterior {
            covariance: &self.covariance,
            x: self.x.as_ref(),
            mean_weights: self.weights.col_as_slice(task).to_vec(),
            prior_scale,
        };
        let explained = |k_xs: &mut Mat<f64>| {
            self.factor.half_solve_in_place(k_xs.as_mut());
            let squared = |col| dot_in_sequence(k_xs.col_as_slice(col), k_xs.col_as_slice(col));
            (0..k_xs.ncols())
                .map(|col| prior_scale * squared(col))
                .collect()
        };
        posterior.predict(x_test, explained)
    }

    /// The factor of G, where its rank is m.
    ///
    /// The singular values of L⁻¹T are taken with columns of length one, so that contexts of very
    /// different torque are not taken for dependent ones. Rounding of T reaches them magnified by the
    /// condition number of L.
    fn task_gram_factor(&self) -> Result<Factor, MtgpError> {
        let (n_inputs, m) = (self.n_inputs(), self.n_tasks());
        let norm = |task| self.task_gram[(task, task)].sqrt().max(f64::MIN_POSITIVE);
        let unit = Mat::from_fn(n_inputs, m, |j, task| {
            self.half_solved[(j, task)] / norm(task)
        });
        let magnified = self.factor.condition_lower_bound().sqrt();
        let smallest = (n_inputs.max(m)) as f64 * f64::EPSILON * magnified;
        let values = thin_svd(unit.as_ref())?.values;
        let rank = values.iter().filter(|value| **value > smallest).count();
        if rank < m {
            return Err(MtgpError::DependentContexts { rank, n_tasks: m });
        }
        Ok(Factor::new(self.task_gram.clone())?)
    }
}
