//! K^ρ as the prior of eq. (16) sees it: a matrix, and the numbers that it is made of.

use faer::{Mat, MatRef};
use kernels::ParamLayout;

/// A covariance K^ρ between m tasks, in some coordinates.
///
/// # Shapes
/// K^ρ (m, m), symmetric and positive semi-definite.
pub trait TaskMatrix: Send + Sync {
    /// Number of tasks m.
    fn n_tasks(&self) -> usize;

    /// K^ρ, (m, m), symmetric.
    fn k_task(&self) -> Mat<f64>;

    /// Names and bounds of the numbers that K^ρ is made of.
    fn layout(&self) -> ParamLayout;

    /// Number of these numbers.
    fn n_params(&self) -> usize;

    /// These numbers, in the order of the layout.
    fn params(&self) -> Vec<f64>;

    /// Replaces them without judging them.
    ///
    /// # Panics
    /// If the count is not [`TaskMatrix::n_params`].
    fn set_params(&mut self, params: &[f64]);

    /// Adds the gradient of a weighted sum of the entries of K^ρ.
    ///
    /// ```text
    /// gradient_i += ∂/∂θ_i Σ_γδ T_γδ K^ρ_γδ
    /// ```
    /// # Shapes
    /// `weights` T, (m, m), which need not be symmetric; `gradient` has one entry per number.
    /// # Panics
    /// On other shapes.
    fn add_adjoint(&self, weights: MatRef<'_, f64>, gradient: &mut [f64]);

    /// Whether K^ρ = 11ᵀ for good: the tasks are one function, and the product with c^x is c^x.
    fn is_one_function(&self) -> bool {
        false
    }

    /// Correlations between tasks, (m, m): K^ρ with its diagonal scaled to ones.
    ///
    /// A task whose variance is zero has correlation zero with the others.
    fn correlations(&self) -> Mat<f64> {
        let k_task = self.k_task();
        Mat::from_fn(self.n_tasks(), self.n_tasks(), |row, col| {
            let size = (k_task[(row, row)] * k_task[(col, col)]).sqrt();
            match (row == col, size > 0.0) {
                (true, _) => 1.0,
                (false, true) => k_task[(row, col)] / size,
                (false, false) => 0.0,
            }
        })
    }
}

/// T + Tᵀ of the weights of a sum of K^ρ's entries.
///
/// # Panics
/// If there are not m by m weights, or the gradient does not have one entry per number.
pub(crate) fn symmetric_weights(
    task: &impl TaskMatrix,
    weights: MatRef<'_, f64>,
    gradient: &[f64],
) -> Mat<f64> {
    let n_tasks = task.n_tasks();
    assert_eq!((weights.nrows(), weights.ncols()), (n_tasks, n_tasks));
    assert_eq!(gradient.len(), task.n_params());
    weights + weights.transpose()
}
