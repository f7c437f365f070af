//! The posterior mean and variance of eqs. (3) and (4) at a set of points.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, ColMut, ColRef, Mat, MatRef, Par};
use kernels::Covariance;
use linalg::sums::dot_in_sequence;

use crate::data::require_inputs;
use crate::error::GpError;
use crate::posterior::condition::Posterior;

/// Test points that are worked on together: bounds the memory to (b, that many).
///
/// The bits of a prediction depend on them.
const BLOCK_ON_SAMPLES: usize = 128;
const BLOCK_ON_PIVOTS: usize = 256;

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
    /// Posterior means at the rows of `x`, in target units.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let mut means = Vec::with_capacity(x.nrows());
        self.for_each_block(x, |_, k_bx| means.extend(self.means_from(k_bx)))?;
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
        let mut n_clamped = 0;
        self.for_each_block(x, |x_block, k_bx| {
            mean.extend(self.means_from(k_bx));
            let prior = self.covariance().diag(x_block);
            self.basis().factor.half_solve_in_place(k_bx.as_mut()); // φ
            let of_block = prior.iter().enumerate().map(|(col, prior)| {
                let unexplained = prior - squared_norm(k_bx.col_as_slice(col));
                // The comparison lets NaN through, which f64::max would turn into certainty.
                if unexplained < 0.0 {
                    n_clamped += 1;
                    return 0.0;
                }
                unexplained
            });
            let first = var.len();
            var.extend(of_block);
            self.add_noise_part(k_bx, &mut var[first..]);
        })?;
        Ok(Prediction {
            mean,
            var,
            n_clamped,
        })
    }

    /// Adds σ²|R⁻ᵀφ|² on pivots.
    fn add_noise_part(&self, phi: &mut Mat<f64>, var: &mut [f64]) {
        let Some(r) = &self.basis().noise_factor else {
            return;
        };
        let noise_var = self.noise_std() * self.noise_std();
        solve_lower_triangular_in_place(r.transpose(), phi.as_mut(), Par::Seq);
        for (col, var) in var.iter_mut().enumerate() {
            *var += noise_var * squared_norm(phi.col_as_slice(col));
        }
    }

    /// k*ᵀβ for every column k* of a block: in sequence on samples, by a matrix product on pivots.
    fn means_from(&self, k_bx: &Mat<f64>) -> Vec<f64> {
        let weights = &self.basis().weights;
        if !self.basis().is_on_pivots() {
            let columns = 0..k_bx.ncols();
            return columns
                .map(|col| dot_in_sequence(k_bx.col_as_slice(col), weights))
                .collect();
        }
        let mut means = vec![0.0; k_bx.ncols()];
        matmul(
            ColMut::from_slice_mut(&mut means),
            Accum::Replace,
            k_bx.transpose(),
            ColRef::from_slice(weights),
            1.0,
            Par::Seq,
        );
        means
    }

    /// Visits the test points in blocks, with c(B, X*) of each, (b, block).
    fn for_each_block(
        &self,
        x: MatRef<'_, f64>,
        mut visit: impl FnMut(MatRef<'_, f64>, &mut Mat<f64>),
    ) -> Result<(), GpError> {
        self.require_points(x)?;
        let block = if self.basis().is_on_pivots() {
            BLOCK_ON_PIVOTS
        } else {
            BLOCK_ON_SAMPLES
        };
        let points = self.basis().points.as_ref();
        let mut k_bx = Mat::zeros(points.nrows(), block.min(x.nrows()));
        for first in (0..x.nrows()).step_by(block) {
            let x_block = x.subrows(first, block.min(x.nrows() - first));
            if x_block.nrows() == k_bx.ncols() {
                k_bx.fill(0.0);
            } else {
                k_bx = Mat::zeros(points.nrows(), x_block.nrows());
            }
            self.covariance().add_cross(points, x_block, k_bx.as_mut());
            visit(x_block, &mut k_bx);
        }
        Ok(())
    }

    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub(super) fn require_points(&self, x: MatRef<'_, f64>) -> Result<(), GpError> {
        require_inputs(x, self.basis().points.ncols())
    }
}

fn squared_norm(values: &[f64]) -> f64 {
    dot_in_sequence(values, values)
}
