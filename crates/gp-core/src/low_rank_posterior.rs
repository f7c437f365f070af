//! The posterior mean and variance of eqs. (3) and (4) from a low-rank factor.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, ColMut, ColRef, Mat, MatRef, Par};
use kernels::Covariance;

use crate::data::{require_finite_inputs, require_noise};
use crate::error::GpError;
use crate::evidence::LowRank;
use crate::evidence::rows;
use crate::posterior::Prediction;

/// Test points that are worked on together: bounds the memory to (r, `BLOCK`).
const BLOCK: usize = 256;

/// A Gaussian process conditioned on data of which r pivots carry all information.
///
/// ```text
/// k = c(x_P, x*),  φ = L_P⁻¹ k                    L_P L_Pᵀ = c(x_P, x_P)
/// mean(x*) = kᵀβ                                   RᵀR = ΦᵀΦ + σ²I
/// var(x*)  = (c(x*, x*) − |φ|²)₊ + σ²|R⁻ᵀφ|²       of the noise-free (latent) torque
/// ```
/// O(r d + r²) per point, whatever the number of samples.
/// With E the remainder of the training covariance, ε its trace and
/// e = c(x*, x*) − |φ|² ≥ 0 its value at the new point, the mean differs from that
/// of eq. (3) by at most
/// ```text
/// √(e ε)|α| + ε|α̂| √c(x*, x*)/σ
/// ```
/// # Source
/// Rasmussen & Williams 2006, eqs. (8.14) and (8.15), with the remainder of the
/// prior variance kept as in Quiñonero-Candela & Rasmussen 2005, sec. 5 (DTC), so
/// that the variance does not vanish far from the pivots.
#[derive(Debug, Clone)]
pub struct LowRankPosterior<C> {
    covariance: C,
    parts: LowRankParts,
}

/// What a low-rank posterior consists of beside its covariance.
///
/// # Shapes
/// r pivots of d covariates.
#[derive(Debug, Clone, PartialEq)]
pub struct LowRankParts {
    /// Noise standard deviation σ, in target units.
    pub noise_std: f64,
    /// Inputs of the pivots, (r, d).
    pub pivots: Mat<f64>,
    /// L_P, (r, r), lower triangular.
    pub pivot_factor: Mat<f64>,
    /// R, (r, r), upper triangular.
    pub noise_factor: Mat<f64>,
    /// β, (r,).
    pub weights: Vec<f64>,
}

impl<C: Covariance> LowRankPosterior<C> {
    pub(crate) fn new(covariance: C, x: MatRef<'_, f64>, low_rank: &LowRank) -> Self {
        let pivoted = low_rank.pivoted();
        let parts = LowRankParts {
            noise_std: low_rank.noise_std(),
            pivots: rows(x, pivoted.pivots()),
            pivot_factor: pivoted.l_p().to_owned(),
            noise_factor: low_rank.r().to_owned(),
            weights: low_rank.beta(),
        };
        Self { covariance, parts }
    }

    /// The posterior that was taken apart by [`LowRankPosterior::parts`].
    ///
    /// # Errors
    /// [`GpError::CountMismatch`] if the parts do not have r rows, columns or entries each;
    /// [`GpError::BadNoise`], [`GpError::NonFiniteInput`] or [`GpError::NonFiniteTarget`]
    /// for numbers that are not usable.
    pub fn from_parts(covariance: C, parts: LowRankParts) -> Result<Self, GpError> {
        let rank = parts.weights.len();
        let sides = [
            parts.pivots.nrows(),
            parts.pivot_factor.nrows(),
            parts.pivot_factor.ncols(),
            parts.noise_factor.nrows(),
            parts.noise_factor.ncols(),
        ];
        if let Some(&side) = sides.iter().find(|side| **side != rank) {
            return Err(GpError::CountMismatch {
                n_inputs: side,
                n_targets: rank,
            });
        }
        require_noise(parts.noise_std)?;
        for matrix in [&parts.pivots, &parts.pivot_factor, &parts.noise_factor] {
            require_finite_inputs(matrix.as_ref())?;
        }
        match parts.weights.iter().position(|value| !value.is_finite()) {
            None => Ok(Self { covariance, parts }),
            Some(row) => Err(GpError::NonFiniteTarget {
                row,
                value: parts.weights[row],
            }),
        }
    }

    pub(crate) fn with_covariance<D: Covariance>(&self, covariance: D) -> LowRankPosterior<D> {
        LowRankPosterior {
            covariance,
            parts: self.parts.clone(),
        }
    }

    /// The covariance function c.
    pub fn covariance(&self) -> &C {
        &self.covariance
    }

    /// The numbers beside the covariance.
    pub fn parts(&self) -> &LowRankParts {
        &self.parts
    }

    /// Noise standard deviation σ, in target units.
    pub fn noise_std(&self) -> f64 {
        self.parts.noise_std
    }

    /// Number of pivots r.
    pub fn rank(&self) -> usize {
        self.parts.weights.len()
    }

    /// Posterior means at the rows of `x`, in target units.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let mut means = Vec::with_capacity(x.nrows());
        self.for_each_block(x, |_, k_px| means.extend(self.means_from(k_px.as_ref())))?;
        Ok(means)
    }

    /// Posterior means and latent variances at the rows of `x`.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict(&self, x: MatRef<'_, f64>) -> Result<Prediction, GpError> {
        let mut mean = Vec::with_capacity(x.nrows());
        let mut var = Vec::with_capacity(x.nrows());
        let mut n_clamped = 0;
        let noise_var = self.parts.noise_std * self.parts.noise_std;
        self.for_each_block(x, |x_block, k_px| {
            mean.extend(self.means_from(k_px.as_ref()));
            let prior = self.covariance.diag(x_block);
            let pivot_factor = self.parts.pivot_factor.as_ref();
            solve_lower_triangular_in_place(pivot_factor, k_px.as_mut(), Par::Seq); // φ
            let remainder: Vec<f64> = (prior.iter().enumerate())
                .map(|(col, prior)| prior - squared_norm(k_px.col_as_slice(col)))
                .collect();
            n_clamped += remainder.iter().filter(|value| **value < 0.0).count();

            let noise_factor = self.parts.noise_factor.transpose();
            solve_lower_triangular_in_place(noise_factor, k_px.as_mut(), Par::Seq); // R⁻ᵀφ
            var.extend((remainder.iter().enumerate()).map(|(col, remainder)| {
                remainder.max(0.0) + noise_var * squared_norm(k_px.col_as_slice(col))
            }));
        })?;
        Ok(Prediction {
            mean,
            var,
            n_clamped,
        })
    }

    /// kᵀβ for every column k of a block.
    fn means_from(&self, k_px: MatRef<'_, f64>) -> Vec<f64> {
        let mut means = vec![0.0; k_px.ncols()];
        matmul(
            ColMut::from_slice_mut(&mut means),
            Accum::Replace,
            k_px.transpose(),
            ColRef::from_slice(&self.parts.weights),
            1.0,
            Par::Seq,
        );
        means
    }

    /// Visits the test points in blocks, with c(x_P, X*) of each, (r, block).
    fn for_each_block(
        &self,
        x: MatRef<'_, f64>,
        mut visit: impl FnMut(MatRef<'_, f64>, &mut Mat<f64>),
    ) -> Result<(), GpError> {
        if x.ncols() != self.parts.pivots.ncols() {
            return Err(GpError::WrongCovariates {
                found: x.ncols(),
                expected: self.parts.pivots.ncols(),
            });
        }
        require_finite_inputs(x)?;
        for first in (0..x.nrows()).step_by(BLOCK) {
            let x_block = x.subrows(first, BLOCK.min(x.nrows() - first));
            let mut k_px = self.covariance.cross(self.parts.pivots.as_ref(), x_block);
            visit(x_block, &mut k_px);
        }
        Ok(())
    }
}

fn squared_norm(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}
