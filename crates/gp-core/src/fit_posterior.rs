//! The posterior of a fit, by whichever path its likelihood took.

use faer::MatRef;
use kernels::{Covariance, TorqueCovariance};

use crate::data::{require_noise, require_training_data};
use crate::error::GpError;
use crate::evidence::LogMarginal;
use crate::evidence::rounding_of_entries;
use crate::evidence::{LikelihoodOptions, Method, MethodUsed};
use crate::low_rank_posterior::LowRankPosterior;
use crate::posterior::{Posterior, Prediction};

/// A function conditioned on data, densely or on a few pivots; a joint's torque by default.
#[derive(Debug, Clone)]
pub enum FitPosterior<C = TorqueCovariance> {
    /// With the Cholesky factor of the whole matrix.
    Dense(Posterior<C>),
    /// With that of a few pivots.
    LowRank(LowRankPosterior<C>),
}

impl<C: Covariance> FitPosterior<C> {
    /// Conditions on data by the path that `options` asks for.
    ///
    /// # Errors
    /// As for [`Posterior::new`].
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

    /// As [`FitPosterior::new`], with the error bound of the likelihood by the same factor.
    ///
    /// # Errors
    /// As for [`FitPosterior::new`].
    /// # Panics
    /// As for [`FitPosterior::new`].
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
            let posterior = LowRankPosterior::new(covariance, x, &low_rank);
            return Ok((Self::LowRank(posterior), low_rank.error_bound()));
        }
        let largest = covariance.diag(x).into_iter().fold(0.0, f64::max);
        let posterior = Posterior::new(covariance, noise_std, x, targets)?;
        let alpha_sq = posterior.alpha().iter().map(|a| a * a).sum();
        let bound = rounding_of_entries(x.nrows(), largest, noise_std * noise_std, alpha_sq);
        Ok((Self::Dense(posterior), bound))
    }

    /// The path taken.
    pub fn method(&self) -> MethodUsed {
        match self {
            Self::Dense(_) => MethodUsed::Dense,
            Self::LowRank(_) => MethodUsed::Certified,
        }
    }

    /// Rank of the factor: the number of samples if dense.
    pub fn rank(&self) -> usize {
        match self {
            Self::Dense(posterior) => posterior.alpha().len(),
            Self::LowRank(posterior) => posterior.rank(),
        }
    }

    /// The covariance function c.
    pub fn covariance(&self) -> &C {
        match self {
            Self::Dense(posterior) => posterior.covariance(),
            Self::LowRank(posterior) => posterior.covariance(),
        }
    }

    /// The same posterior under a covariance that knows more inputs.
    ///
    /// Weights and factors stay: the caller vouches that both covariances agree, to the bit, on
    /// the inputs that the posterior is made of.
    pub fn with_covariance<D: Covariance>(&self, covariance: D) -> FitPosterior<D> {
        match self {
            Self::Dense(posterior) => FitPosterior::Dense(posterior.with_covariance(covariance)),
            Self::LowRank(posterior) => {
                FitPosterior::LowRank(posterior.with_covariance(covariance))
            }
        }
    }

    /// Noise standard deviation σ, in target units.
    pub fn noise_std(&self) -> f64 {
        match self {
            Self::Dense(posterior) => posterior.noise_std(),
            Self::LowRank(posterior) => posterior.noise_std(),
        }
    }

    /// Posterior means at the rows of `x`, in target units.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        match self {
            Self::Dense(posterior) => posterior.predict_mean(x),
            Self::LowRank(posterior) => posterior.predict_mean(x),
        }
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
        match self {
            Self::Dense(posterior) => posterior.predict(x),
            Self::LowRank(posterior) => posterior.predict(x),
        }
    }

    /// A lower bound on the condition number of K + σ²I in the 2-norm.
    pub fn condition_lower_bound(&self) -> f64 {
        match self {
            Self::Dense(posterior) => posterior.factor().condition_lower_bound(),
            Self::LowRank(posterior) => {
                // K + σ²I is at least ΦΦᵀ + σ²I, with eigenvalues of σ² and up to |R|².
                let r = &posterior.parts().noise_factor;
                let largest = (0..r.nrows())
                    .map(|idx| r[(idx, idx)])
                    .fold(posterior.noise_std(), f64::max);
                (largest / posterior.noise_std()).powi(2)
            }
        }
    }
}

impl<C: Covariance + Clone> FitPosterior<C> {
    /// The same posterior on a few pivots: predictions then take O(r²) instead of O(n²).
    ///
    /// ```text
    /// t = L Lᵀα,   the targets that it was conditioned on
    /// ```
    /// `certificate` is the error of the log marginal likelihood that the pivots may make, in nats.
    /// A posterior that is on pivots, or that would need more than half of its samples as
    /// pivots, stays as it is.
    /// # Errors
    /// As for [`FitPosterior::new`].
    pub fn on_pivots(&self, certificate: f64) -> Result<Self, GpError> {
        let Self::Dense(dense) = self else {
            return Ok(self.clone());
        };
        let options = LikelihoodOptions {
            method: Method::Certified,
            certificate,
        };
        let targets = dense.factor().product(dense.alpha());
        let covariance = dense.covariance().clone();
        let on_pivots = Self::new(covariance, dense.noise_std(), dense.x(), &targets, options)?;
        let is_smaller = 2 * on_pivots.rank() <= self.rank();
        Ok(if is_smaller { on_pivots } else { self.clone() })
    }
}
