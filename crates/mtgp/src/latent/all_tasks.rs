//! Predictions of all tasks at the same inputs for little more than those of one.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use gp_core::Posterior;
use gp_core::data::require_inputs;
use kernels::Covariance;

use crate::error::MtgpError;
use crate::latent::whitening::points_of;
use crate::prior::{MultiTaskCovariance, TaskMatrix};

/// Test inputs that are worked on together: bounds the memory to (`BLOCK`, p).
const BLOCK: usize = 256;

/// Posterior means of every task at the rows of `x`, in target units.
///
/// ```text
/// mean_γ(x*) = Σ_a w_a (K^ρ)_γγ(a) c^x(x*, x_a)      over p samples or pivots a
/// ```
/// c^x is computed once for all tasks: O(p d + p m) per input.
/// # Shapes
/// `x` (k, 3ℓ); the result (k, m).
/// # Errors
/// [`gp_core::GpError::WrongCovariates`] or [`gp_core::GpError::NonFiniteInput`].
/// # Source
/// Eqs. (3) and (16).
pub fn predict_mean_of_all_tasks(
    posterior: &Posterior<MultiTaskCovariance>,
    x: MatRef<'_, f64>,
) -> Result<Mat<f64>, MtgpError> {
    let (x_known, tasks) = points_of(posterior);
    require_inputs(x, x_known.ncols())?;
    let weights = &posterior.basis().weights;
    let k_task = posterior.covariance().task().k_task();
    let n_tasks = k_task.nrows();
    // (p, m)
    let of_tasks = Mat::from_fn(weights.len(), n_tasks, |a, task| {
        weights[a] * k_task[(task, tasks[a])]
    });

    let mut means = Mat::zeros(x.nrows(), n_tasks);
    let mut memory = Mat::zeros(BLOCK.min(x.nrows()), weights.len());
    for first in (0..x.nrows()).step_by(BLOCK) {
        let size = BLOCK.min(x.nrows() - first);
        let mut k_sp = memory.as_mut().subrows_mut(0, size);
        k_sp.fill(0.0);
        let x_block = x.subrows(first, size);
        posterior
            .covariance()
            .input()
            .add_cross(x_block, x_known, k_sp.as_mut());
        let block = means.as_mut().subrows_mut(first, size);
        matmul(block, Accum::Replace, &k_sp, &of_tasks, 1.0, Par::Seq);
    }
    Ok(means)
}
