//! Predictions of all tasks at the same inputs for little more than those of one.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use gp_core::Posterior;
use kernels::Covariance;

use crate::error::MtgpError;
use crate::error::require_finite_inputs;
use crate::error::require_inputs;
use crate::fit::SharedFit;
use crate::fit::TaskFit;
use crate::prior::MultiTaskCovariance;
use crate::prior::TaskMatrix;
use crate::prior::split;

/// Test inputs that are worked on together: bounds the memory to (`BLOCK`, p).
const BLOCK: usize = 256;

impl TaskFit {
    /// Posterior means of every task at the rows of `x`, in target units.
    ///
    /// ```text
    /// mean_γ(x*) = Σ_a w_a (K^ρ)_γγ(a) c^x(x*, x_a)      over p samples or pivots a
    /// ```
    /// c^x is computed once for all tasks: O(p d + p m) per input.
    /// # Shapes
    /// `x` (k, 3ℓ); the result (k, m).
    /// # Errors
    /// As for [`TaskFit::predict`].
    /// # Source
    /// Eqs. (3) and (16).
    pub fn predict_mean_of_all_tasks(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, MtgpError> {
        self.rows_of(0, x.subrows(0, 0))?;
        require_finite_inputs(x)?;
        Ok(means_of_all_tasks(&self.posterior, x))
    }
}

impl SharedFit {
    /// Posterior means of every task for one joint, from 0, at the rows of `x`, as for [`TaskFit`].
    ///
    /// # Shapes
    /// `x` (k, 3ℓ); the result (k, m).
    /// # Errors
    /// As for [`TaskFit::predict`].
    /// # Panics
    /// If there is no such joint.
    pub fn predict_mean_of_all_tasks(
        &self,
        joint_idx: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, MtgpError> {
        let posterior = &self.joints[joint_idx];
        let n_covariates = posterior.covariance().input().linear().linear_std().len();
        require_inputs(x, n_covariates)?;
        Ok(means_of_all_tasks(posterior, x))
    }
}

/// Means at inputs that fit and are finite.
fn means_of_all_tasks(posterior: &Posterior<MultiTaskCovariance>, x: MatRef<'_, f64>) -> Mat<f64> {
    let (rows, weights) = (
        posterior.basis().points.as_ref(),
        &posterior.basis().weights,
    );
    let k_task = posterior.covariance().task().k_task();
    let n_tasks = k_task.nrows();
    let (x_known, tasks) = split(rows, n_tasks);
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
    means
}
