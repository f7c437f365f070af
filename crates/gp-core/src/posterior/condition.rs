//! Conditioning on data, densely or on a few pivots.

use faer::{Mat, MatRef};
use kernels::{Covariance, Jitter, TorqueCovariance};
use linalg::Factor;

use crate::data::{require_noise, require_training_data};
use crate::error::GpError;
use crate::evidence::{
    LikelihoodOptions, LogMarginal, LowRank, Method, MethodUsed, rounding_of_entries, rows,
};
use crate::posterior::basis::Basis;

/// A Gaussian process conditioned on data; over a joint's torque by default.
///
/// ```text
/// mean(x*) = k*ᵀ β                              k* = c(B, x*) for points B
/// samples as B:   φ = L⁻¹k*,  var(x*) = c(x*, x*) − |φ|²
/// pivots as B:    φ = L⁻¹k*,  var(x*) = (c(x*, x*) − |φ|²)₊ + σ²|R⁻ᵀφ|²
/// ```
/// of the noise-free (latent) torque; add σ² for a new observation.
/// On r pivots that costs O(r d + r²) a point, whatever the number of samples.
/// With E the remainder of the training covariance, ε its trace and
/// e = c(x*, x*) − |φ|² ≥ 0 its value at the new point, the mean differs from that
/// of eq. (3) by at most
/// ```text
/// √(e ε)|α| + ε|α̂| √c(x*, x*)/σ
/// ```
/// # Source
/// Eqs. (3)–(4); Rasmussen & Williams 2006, algorithm 2.1 and eqs. (8.14), (8.15), with the
/// remainder of the prior variance kept as in Quiñonero-Candela & Rasmussen 2005, sec. 5 (DTC),
/// so that the variance does not vanish far from the pivots.
#[derive(Debug, Clone)]
pub struct Posterior<C = TorqueCovariance> {
    covariance: C,
    noise_std: f64,
    basis: Basis,
}

impl<C: Covariance> Posterior<C> {
    /// Conditions a zero-mean process on data by the path that `options` asks for.
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
        options: LikelihoodOptions,
    ) -> Result<Self, GpError> {
        Self::with_error_bound(covariance, noise_std, x, targets, options)
            .map(|(posterior, _)| posterior)
    }

    /// As [`Posterior::new`], with the error bound of the likelihood by the same factor, in nats.
    ///
    /// # Errors
    /// As for [`Posterior::new`].
    /// # Panics
    /// As for [`Posterior::new`].
    pub fn with_error_bound(
        covariance: C,
        noise_std: f64,
        x: MatRef<'_, f64>,
        targets: &[f64],
        options: LikelihoodOptions,
    ) -> Result<(Self, f64), GpError> {
        require_training_data(x, targets, 1)?;
        require_noise(noise_std)?;
        let low_rank = LogMarginal::new(x, targets, options).low_rank(&covariance, noise_std)?;
        if let Some(low_rank) = low_rank {
            let posterior = Self::on_pivots_of(covariance, x, &low_rank);
            return Ok((posterior, low_rank.error_bound()));
        }
        let largest = covariance.diag(x).into_iter().fold(0.0, f64::max);
        let posterior = Self::dense(covariance, noise_std, x, targets)?;
        let alpha_sq = posterior.basis.weights.iter().map(|a| a * a).sum();
        let bound = rounding_of_entries(x.nrows(), largest, noise_std * noise_std, alpha_sq);
        Ok((posterior, bound))
    }

    /// Conditions by a factor of the whole matrix.
    ///
    /// # Errors
    /// As for [`Posterior::new`].
    /// # Panics
    /// As for [`Posterior::new`].
    pub fn dense(
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
        let basis = Basis {
            points: x.to_owned(),
            weights: factor.solve(targets),
            factor,
            noise_factor: None,
        };
        Ok(Self::of_basis(covariance, noise_std, basis))
    }

    fn on_pivots_of(covariance: C, x: MatRef<'_, f64>, low_rank: &LowRank) -> Self {
        let pivoted = low_rank.pivoted();
        let basis = Basis {
            points: rows(x, pivoted.pivots()),
            weights: low_rank.beta(),
            factor: Factor::from_lower(pivoted.l_p().to_owned()),
            noise_factor: Some(low_rank.r().to_owned()),
        };
        Self::of_basis(covariance, low_rank.noise_std(), basis)
    }

    /// The posterior that consists of given parts, as a model file holds them.
    ///
    /// # Errors
    /// [`GpError::CountMismatch`] if the parts do not have b rows, columns or entries each;
    /// [`GpError::BadNoise`], [`GpError::NonFiniteInput`] or [`GpError::NonFiniteTarget`]
    /// for numbers that are not usable.
    pub fn from_parts(covariance: C, noise_std: f64, basis: Basis) -> Result<Self, GpError> {
        basis.require_usable(noise_std)?;
        Ok(Self::of_basis(covariance, noise_std, basis))
    }

    pub(super) fn of_basis(covariance: C, noise_std: f64, basis: Basis) -> Self {
        Self {
            covariance,
            noise_std,
            basis,
        }
    }

    /// The same posterior under a covariance that knows more inputs.
    ///
    /// Weights and factors stay: the caller vouches that both covariances agree, to the bit, on
    /// the inputs that the posterior is made of.
    pub fn with_covariance<D: Covariance>(&self, covariance: D) -> Posterior<D> {
        Posterior::of_basis(covariance, self.noise_std, self.basis.clone())
    }

    /// The covariance function c.
    pub fn covariance(&self) -> &C {
        &self.covariance
    }

    /// Noise standard deviation σ, in target units.
    pub fn noise_std(&self) -> f64 {
        self.noise_std
    }

    /// The points, weights and factors that it consists of.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// The path taken.
    pub fn method(&self) -> MethodUsed {
        if self.basis.is_on_pivots() {
            MethodUsed::Certified
        } else {
            MethodUsed::Dense
        }
    }

    /// Rank of the factor: the number of samples if dense.
    pub fn rank(&self) -> usize {
        self.basis.rank()
    }

    /// A lower bound on the condition number of K + σ²I in the 2-norm.
    pub fn condition_lower_bound(&self) -> f64 {
        let Some(r) = &self.basis.noise_factor else {
            return self.basis.factor.condition_lower_bound();
        };
        // K + σ²I is at least ΦΦᵀ + σ²I, with eigenvalues of σ² and up to |R|².
        let diagonal = (0..r.nrows()).map(|idx| r[(idx, idx)]);
        let largest = diagonal.fold(self.noise_std, f64::max);
        (largest / self.noise_std).powi(2)
    }
}

impl<C: Covariance + Clone> Posterior<C> {
    /// The same posterior on a few pivots: predictions then take O(r²) instead of O(n²).
    ///
    /// ```text
    /// t = L Lᵀα,   the targets that it was conditioned on
    /// ```
    /// `certificate` is the error of the log marginal likelihood that the pivots may make, in nats.
    /// A posterior that is on pivots, or that would need more than half of its samples as
    /// pivots, stays as it is.
    /// # Errors
    /// As for [`Posterior::new`].
    pub fn on_pivots(&self, certificate: f64) -> Result<Self, GpError> {
        if self.basis.is_on_pivots() {
            return Ok(self.clone());
        }
        let options = LikelihoodOptions {
            method: Method::Certified,
            certificate,
        };
        let Basis {
            points,
            weights,
            factor,
            ..
        } = &self.basis;
        let (targets, covariance) = (factor.product(weights), self.covariance.clone());
        let on_pivots = Self::new(
            covariance,
            self.noise_std,
            points.as_ref(),
            &targets,
            options,
        )?;
        let is_smaller = 2 * on_pivots.rank() <= self.rank();
        Ok(if is_smaller { on_pivots } else { self.clone() })
    }
}
