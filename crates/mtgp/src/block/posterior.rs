//! The multi-task process conditioned on a complete block, by two small eigendecompositions.
//!
//! Every context γ is observed at the same ν inputs, T_jγ = t^γ(x_j), with noise of variance d_γ:
//!
//! ```text
//! Σ = K^ρ ⊗ K^x + D ⊗ I                      covariance of vec T, (mν, mν), D = diag(d)
//! D^{−½} K^ρ D^{−½} = U diag(λ) Uᵀ            (m, m)
//! K^x = V diag(s) Vᵀ                          (ν, ν)
//! Σ⁻¹ = (D^{−½}U ⊗ V) diag(W) (UᵀD^{−½} ⊗ Vᵀ),      W_jc = 1/(1 + s_j λ_c)
//! ```
//!
//! With Ỹ = VᵀTD^{−½}U and Z = W ∘ Ỹ, both (ν, m), the matrix A of vec A = Σ⁻¹ vec T is
//! V Z UᵀD^{−½}, and
//!
//! ```text
//! log p = −½ Σ_jc (W_jc Ỹ_jc² − log W_jc) − ½ ν log|D| − ½ mν log 2π
//! ∂ log p = tr(Q^x ∂K^x) + tr(Q^ρ ∂K^ρ) + Σ_γ q_γ ∂d_γ
//! Q^x = ½ V (Z diag(λ) Zᵀ − diag_j Σ_c W_jc λ_c) Vᵀ
//! Q^ρ = ½ D^{−½}U (Zᵀ diag(s) Z − diag_c Σ_j W_jc s_j) UᵀD^{−½}
//! q_γ = ½ (Σ_j A_jγ² − d_γ⁻¹ Σ_jc U_γc² W_jc)
//! ```
//! All of it takes O(ν³ + m³ + mν(m + ν)) operations, where a factorisation of Σ takes (mν)³/3.
//!
//! Source: eq. (17); the decomposition is that of Stegle et al. 2011, "Efficient inference in
//! matrix-variate Gaussian models with iid observation noise", sec. 3; the identities of Kronecker
//! products, Golub & Van Loan 2013, sec. 12.3.

use std::f64::consts::PI;

use faer::{Mat, MatRef};
use gp_core::data::require_noise;
use gp_core::{GpError, Prediction};
use kernels::Covariance;
use linalg::sums::dot_in_sequence;
use linalg::{SymmetricEigen, product, symmetric_eigen};

use crate::block::prediction::TaskPosterior;
use crate::error::MtgpError;

/// A multi-task process conditioned on a complete block.
///
/// ```text
/// C(τ^γ(x), τ^δ(x′)) = (K^ρ)_γδ c^x(x, x′)         t^γ = τ^γ + noise of variance d_γ
/// ```
/// # Source
/// Eqs. (16) and (17).
#[derive(Debug, Clone)]
pub struct BlockPosterior<'a, C> {
    covariance: C,
    /// (ν, d).
    x: MatRef<'a, f64>,
    k_task: Mat<f64>,
    noise_std: Vec<f64>,
    of_tasks: SymmetricEigen,
    of_inputs: SymmetricEigen,
    /// max_j c^x(x_j, x_j).
    largest_variance: f64,
    /// Ỹ, (ν, m).
    projected: Mat<f64>,
}

/// Gradient of the log marginal likelihood of a [`BlockPosterior`].
#[derive(Debug, Clone)]
pub struct BlockGradient {
    /// ∂/∂θ^x, in the order of the covariance's layout.
    pub theta: Vec<f64>,
    /// The symmetric Q^ρ of ∂ log p = tr(Q^ρ ∂K^ρ), (m, m).
    pub k_task: Mat<f64>,
    /// ∂/∂σ_γ, (m,); their sum is the derivative by a noise level that all tasks share.
    pub noise_std: Vec<f64>,
}

impl BlockGradient {
    /// Gradient with respect to every entry of a factor Λ of K^ρ = ΛΛᵀ.
    ///
    /// ```text
    /// ∂ log p/∂Λ = 2 Q^ρ Λ
    /// ```
    /// # Shapes
    /// `lambda` (m, r), as the result; entries that are fixed at zero have a derivative too.
    /// # Panics
    /// If `lambda` does not have m rows.
    pub fn of_factor(&self, lambda: MatRef<'_, f64>) -> Mat<f64> {
        2.0 * product(self.k_task.as_ref(), lambda)
    }
}

impl<'a, C: Covariance> BlockPosterior<'a, C> {
    /// Conditions on torques that are finite, as many inputs as there are rows of them.
    ///
    /// # Errors
    /// [`GpError::BadNoise`] for a σ that is not positive; [`MtgpError::NoSpectrum`] for a covariance that
    /// is not finite.
    /// # Panics
    /// If K^ρ is not (m, m), there is not one σ per task, or `x` does not have the columns that the
    /// covariance needs.
    pub(crate) fn new(
        covariance: C,
        k_task: MatRef<'_, f64>,
        noise_std: &[f64],
        x: MatRef<'a, f64>,
        targets: MatRef<'_, f64>,
    ) -> Result<Self, MtgpError> {
        let m = noise_std.len();
        assert_eq!((k_task.nrows(), k_task.ncols()), (m, m));
        assert_eq!(targets.ncols(), m);
        for std in noise_std {
            require_noise(*std)?;
        }

        let whitened = Mat::from_fn(m, m, |row, col| {
            k_task[(row.max(col), row.min(col))] / (noise_std[row] * noise_std[col])
        });
        let of_tasks = positive_part(symmetric_eigen(whitened.as_ref())?);
        let k_x = covariance.gram(x);
        let largest_variance = (0..x.nrows()).map(|j| k_x[(j, j)]).fold(0.0, f64::max);
        let of_inputs = positive_part(symmetric_eigen(k_x.as_ref())?);

        let scaled = Mat::from_fn(x.nrows(), m, |j, task| targets[(j, task)] / noise_std[task]);
        let rotated = product(scaled.as_ref(), of_tasks.vectors.as_ref()); // (ν, m)
        let projected = product(of_inputs.vectors.transpose(), rotated.as_ref()); // (ν, m)
        Ok(Self {
            covariance,
            x,
            k_task: Mat::from_fn(m, m, |row, col| k_task[(row.max(col), row.min(col))]),
            noise_std: noise_std.to_vec(),
            of_tasks,
            of_inputs,
            largest_variance,
            projected,
        })
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.noise_std.len()
    }

    /// The log marginal likelihood, natural log, summed over all mν observations.
    ///
    /// ```text
    /// log p(vec T) = −½ vec(T)ᵀΣ⁻¹vec(T) − ½ log|Σ| − ½ mν log 2π
    /// ```
    /// # Errors
    /// [`GpError::NonFiniteLikelihood`] if it overflows.
    /// # Source
    /// Eq. (8) with the covariance of eq. (17).
    pub fn log_marginal_likelihood(&self) -> Result<f64, MtgpError> {
        let (n_inputs, m) = (self.x.nrows(), self.n_tasks());
        let mut twice = 0.0;
        for task in 0..m {
            for (j, y) in self.projected.col_as_slice(task).iter().enumerate() {
                twice += y * y * self.weight(j, task) + self.scale(j, task).ln();
            }
        }
        let log_det_noise: f64 = self.noise_std.iter().map(|std| 2.0 * std.ln()).sum();
        let n = (n_inputs * m) as f64;
        let value = -0.5 * (twice + n_inputs as f64 * log_det_noise + n * (2.0 * PI).ln());
        if value.is_finite() {
            return Ok(value);
        }
        let n_samples = n_inputs * m;
        Err(GpError::NonFiniteLikelihood { n_samples }.into())
    }

    /// Its gradient with respect to θ^x, K^ρ and every σ_γ.
    pub fn gradient(&self) -> BlockGradient {
        let weighted = self.weighted(); // Z, (ν, m)
        let mut theta = vec![0.0; self.covariance.n_params()];
        let of_k_x = self.adjoint_of_inputs(&weighted);
        self.covariance
            .gram_adjoint(self.x, of_k_x.as_ref(), &mut theta);
        BlockGradient {
            theta,
            k_task: self.adjoint_of_tasks(&weighted),
            noise_std: self.gradient_of_noise(&weighted),
        }
    }

    /// Posterior mean and latent variance of one context's torque at the rows of `x_test`.
    ///
    /// ```text
    /// mean = ((K^ρ)_·γ ⊗ k*)ᵀ Σ⁻¹ vec T = k*ᵀ A (K^ρ)_·γ
    /// var  = (K^ρ)_γγ c(x*, x*) − Σ_j (Vᵀk*)_j² Σ_c W_jc b_c²,      b = UᵀD^{−½}(K^ρ)_·γ
    /// ```
    /// Add σ_γ² to the variance for that of a new observation.
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Panics
    /// If there is no such task.
    /// # Source
    /// Eq. (17); its variance by eq. (4).
    pub fn predict(&self, task: usize, x_test: MatRef<'_, f64>) -> Result<Prediction, MtgpError> {
        let m = self.n_tasks();
        let whitened = Mat::from_fn(m, 1, |row, _| {
            self.k_task[(row, task)] / self.noise_std[row]
        });
        let b = product(self.of_tasks.vectors.transpose(), whitened.as_ref()); // (m, 1)
        let along = product(self.weighted().as_ref(), b.as_ref()); // (ν, 1)
        let mean_weights = product(self.of_inputs.vectors.as_ref(), along.as_ref()); // (ν, 1)
        let gain = |j| {
            (0..m)
                .map(|c| self.weight(j, c) * b[(c, 0)] * b[(c, 0)])
                .sum()
        };
        let gains: Vec<f64> = (0..self.x.nrows()).map(gain).collect();

        let posterior = TaskPosterior {
            covariance: &self.covariance,
            x: self.x,
            mean_weights: mean_weights.col_as_slice(0).to_vec(),
            prior_scale: self.k_task[(task, task)],
        };
        let explained = |k_xs: &mut Mat<f64>| {
            let rotated = product(self.of_inputs.vectors.transpose(), k_xs.as_ref());
            let part = |col| weighted_square(rotated.col_as_slice(col), &gains);
            (0..rotated.ncols()).map(part).collect()
        };
        posterior.predict(x_test, explained)
    }

    /// Roughly the error that rounding Σ leaves in its log marginal likelihood, in nats.
    ///
    /// ```text
    /// ε max_a Σ_aa max(mν/min d, |A|²)
    /// ```
    /// As for the dense path of `gp_core`.
    pub(crate) fn rounding(&self) -> f64 {
        let variances = self.noise_std.iter().map(|std| std * std);
        let smallest = variances.clone().fold(f64::INFINITY, f64::min);
        let largest = variances
            .enumerate()
            .map(|(task, var)| self.k_task[(task, task)] * self.largest_variance + var);
        let largest = largest.fold(0.0, f64::max);
        let n = (self.x.nrows() * self.n_tasks()) as f64;
        let weights = self.rotated_weights(&self.weighted()).squared_norm_l2();
        f64::EPSILON * largest * (n / smallest).max(weights)
    }

    /// 1/W_jc = 1 + s_j λ_c.
    fn scale(&self, j: usize, c: usize) -> f64 {
        1.0 + self.of_inputs.values[j] * self.of_tasks.values[c]
    }

    /// W_jc.
    fn weight(&self, j: usize, c: usize) -> f64 {
        self.scale(j, c).recip()
    }

    /// Z = W ∘ Ỹ, (ν, m).
    fn weighted(&self) -> Mat<f64> {
        let projected = self.projected.as_ref();
        Mat::from_fn(projected.nrows(), projected.ncols(), |j, c| {
            projected[(j, c)] * self.weight(j, c)
        })
    }

    /// Q^x, (ν, ν).
    fn adjoint_of_inputs(&self, weighted: &Mat<f64>) -> Mat<f64> {
        let values = &self.of_tasks.values;
        let traces = (0..weighted.nrows())
            .map(|j| {
                (0..values.len())
                    .map(|c| self.weight(j, c) * values[c])
                    .sum()
            })
            .collect();
        half_difference(
            weighted.as_ref(),
            values,
            traces,
            self.of_inputs.vectors.as_ref(),
        )
    }

    /// Q^ρ, (m, m).
    fn adjoint_of_tasks(&self, weighted: &Mat<f64>) -> Mat<f64> {
        let values = &self.of_inputs.values;
        let traces = (0..weighted.ncols())
            .map(|c| {
                (0..values.len())
                    .map(|j| self.weight(j, c) * values[j])
                    .sum()
            })
            .collect();
        let whitened = self.whitened_vectors();
        half_difference(weighted.transpose(), values, traces, whitened.as_ref())
    }

    /// σ_γ (Σ_j A_jγ² − d_γ⁻¹ Σ_jc U_γc² W_jc), (m,).
    fn gradient_of_noise(&self, weighted: &Mat<f64>) -> Vec<f64> {
        let whitened = self.whitened_vectors();
        let rotated = self.rotated_weights(weighted);
        let trace = |c| (0..self.x.nrows()).map(|j| self.weight(j, c)).sum();
        let traces: Vec<f64> = (0..self.n_tasks()).map(trace).collect();
        (self.noise_std.iter().enumerate())
            .map(|(task, std)| {
                let column = rotated.col_as_slice(task);
                let inverse: f64 = (traces.iter().enumerate())
                    .map(|(c, trace)| whitened[(task, c)] * whitened[(task, c)] * trace)
                    .sum();
                std * (dot_in_sequence(column, column) - inverse)
            })
            .collect()
    }

    /// VᵀA = Z UᵀD^{−½}, (ν, m), whose columns have the norms of those of A, as V is orthogonal.
    fn rotated_weights(&self, weighted: &Mat<f64>) -> Mat<f64> {
        product(weighted.as_ref(), self.whitened_vectors().transpose())
    }

    /// D^{−½}U, (m, m).
    fn whitened_vectors(&self) -> Mat<f64> {
        let u = &self.of_tasks.vectors;
        Mat::from_fn(u.nrows(), u.ncols(), |task, c| {
            u[(task, c)] / self.noise_std[task]
        })
    }
}

/// Eigenvalues that rounding took below zero, set to zero: both matrices are positive semi-definite.
fn positive_part(mut eigen: SymmetricEigen) -> SymmetricEigen {
    for value in &mut eigen.values {
        *value = value.max(0.0);
    }
    eigen
}

/// ½ B (Z diag(values) Zᵀ − diag(traces)) Bᵀ
fn half_difference(
    z: MatRef<'_, f64>,
    values: &[f64],
    traces: Vec<f64>,
    basis: MatRef<'_, f64>,
) -> Mat<f64> {
    let scaled = Mat::from_fn(z.nrows(), z.ncols(), |row, col| z[(row, col)] * values[col]);
    let mut inner = product(scaled.as_ref(), z.transpose());
    for (idx, trace) in traces.into_iter().enumerate() {
        inner[(idx, idx)] -= trace;
    }
    let left = product(basis, inner.as_ref());
    0.5 * product(left.as_ref(), basis.transpose())
}

/// Σ_j gains_j v_j²
fn weighted_square(values: &[f64], gains: &[f64]) -> f64 {
    let terms = values.iter().zip(gains);
    terms.map(|(value, gain)| gain * value * value).sum()
}
