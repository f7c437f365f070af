//! Posterior means and variances at many test points, a block of them at a time.

use faer::{Mat, MatRef};
use gp_core::Prediction;
use gp_core::data::require_inputs;
use kernels::Covariance;
use linalg::sums::dot_in_sequence;

use crate::error::MtgpError;

/// Test points that are worked on together: bounds the memory to (ν, `BLOCK`).
const BLOCK: usize = 128;

/// One context's posterior, as weights on the covariances with the ν distinct inputs.
///
/// ```text
/// mean(x*) = k*ᵀ w,    var(x*) = κ c(x*, x*) − e(k*)         k* = c(X, x*)
/// ```
pub(crate) struct TaskPosterior<'a, C> {
    /// c.
    pub covariance: &'a C,
    /// X, (ν, d).
    pub x: MatRef<'a, f64>,
    /// w, (ν,).
    pub mean_weights: Vec<f64>,
    /// κ = (K^ρ)_γγ.
    pub prior_scale: f64,
}

impl<C: Covariance> TaskPosterior<'_, C> {
    /// Means and variances at the rows of `x_test`.
    ///
    /// `explained` returns e of every column k* of a (ν, block) matrix, which it may overwrite.
    /// # Errors
    /// [`gp_core::GpError::WrongCovariates`] or [`gp_core::GpError::NonFiniteInput`].
    pub fn predict(
        &self,
        x_test: MatRef<'_, f64>,
        mut explained: impl FnMut(&mut Mat<f64>) -> Vec<f64>,
    ) -> Result<Prediction, MtgpError> {
        require_inputs(x_test, self.x.ncols())?;
        let n_test = x_test.nrows();
        let (mut mean, mut var) = (Vec::with_capacity(n_test), Vec::with_capacity(n_test));
        for first in (0..n_test).step_by(BLOCK) {
            let x_block = x_test.subrows(first, BLOCK.min(n_test - first));
            let mut k_xs = self.covariance.cross(self.x, x_block); // (ν, block)
            let column_mean = |col| dot_in_sequence(k_xs.col_as_slice(col), &self.mean_weights);
            mean.extend((0..k_xs.ncols()).map(column_mean));
            let prior = self.covariance.diag(x_block);
            let parts = explained(&mut k_xs);
            let rest = |(prior, part): (&f64, f64)| self.prior_scale * prior - part;
            var.extend(prior.iter().zip(parts).map(rest));
        }
        let n_clamped = clamp_at_zero(&mut var);
        Ok(Prediction {
            mean,
            var,
            n_clamped,
        })
    }
}

/// Sets values below zero to zero and counts them.
fn clamp_at_zero(values: &mut [f64]) -> usize {
    let mut n_clamped = 0;
    for value in values.iter_mut().filter(|value| **value < 0.0) {
        *value = 0.0;
        n_clamped += 1;
    }
    n_clamped
}
