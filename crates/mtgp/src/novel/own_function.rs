//! Means of a new context that has a function of its own, which no grown Λ can hold.

use faer::{Mat, MatRef};
use gp_core::Posterior;
use gp_core::data::require_inputs;
use kernels::Covariance;

use crate::error::MtgpError;
use crate::latent::{add_transposed_product, points_of, require_torques};
use crate::novel::row::NewTorques;
use crate::prior::{MultiTaskCovariance, TaskRow};

/// Test points that are worked on together: bounds the memory to (n, `BLOCK`).
const BLOCK: usize = 128;

/// Posterior means of a new context given the old data and its own torques, in target units.
///
/// ```text
/// A = cov_D(t*, t*) + σ²I,   α* = A⁻¹(t* − mean_D(X*))
/// mean(f) = mean_D(f) + cov_D(f, t*) α*
/// ```
/// which is the posterior given D ∪ D* with Λ grown by the row λ and a column for s: the same
/// as if all samples had been conditioned on at once, but no matrix of order n is factorised
/// again. With G = P c(B, t*) as the posterior has P, cov_D(f, t*) = c(f, t*) − c(f, B)G, and a
/// mean takes O(n + k).
/// # Shapes
/// `x` (k, d), the states of the new torques, and `test` (p, d), without a column for the task.
/// # Errors
/// Shapes and numbers of inputs, torques and row as for [`crate::novel::log_density_of_row`];
/// [`gp_core::GpError::WrongCovariates`], [`gp_core::GpError::NonFiniteInput`] or
/// [`gp_core::GpError::NotPositiveDefinite`].
/// # Panics
/// If the latent functions are not those at the rows of `x`.
/// # Source
/// Section 5: inference with the grown K^ρ; eq. (3) applied to D and then to D*.
pub fn predict_mean_of_new_context(
    posterior: &Posterior<MultiTaskCovariance>,
    row: &TaskRow,
    x: MatRef<'_, f64>,
    new: NewTorques<'_>,
    test: MatRef<'_, f64>,
) -> Result<Vec<f64>, MtgpError> {
    let n_points = new.latent.n_points();
    assert_eq!(n_points, x.nrows());
    require_torques(new.torques, n_points)?;
    let density = new.latent.density(row)?;
    let n_columns = points_of(posterior).0.ncols();
    require_inputs(x, n_columns)?;
    require_inputs(test, n_columns)?;
    let residual: Vec<f64> = (new.torques.iter().zip(density.mean()))
        .map(|(torque, mean)| torque - mean)
        .collect();
    let alpha = density.factor().solve(&residual); // α*, (k,)

    let basis = posterior.basis();
    let mut explained = cross_with_basis(posterior, row, x); // G, (b, k)
    basis.solve_in_place(posterior.noise_std(), &mut explained);
    let mut correction = vec![0.0; explained.nrows()];
    add_transposed_product(explained.transpose(), &alpha, &mut correction);
    let weights = basis.weights.iter().zip(correction);
    let weights: Vec<f64> = weights.map(|(weight, part)| weight - part).collect(); // β − Gα*

    // c(f, B)(β − Gα*) + c(f, t*)α*
    let own_var = row.dot(&row.entries) + row.own_std * row.own_std;
    let mut means = vec![0.0; test.nrows()];
    for (block_idx, mean) in means.chunks_mut(BLOCK).enumerate() {
        let points = test.subrows(block_idx * BLOCK, mean.len());
        let k_bf = cross_with_basis(posterior, row, points); // (b, block)
        add_transposed_product(k_bf.as_ref(), &weights, mean);
        let c_sf = faer::Scale(own_var) * posterior.covariance().input().cross(x, points); // (k, block)
        add_transposed_product(c_sf.as_ref(), &alpha, mean);
    }
    Ok(means)
}

/// c(B, f) for the torques f of a task: Λ_γ(a)·λ c^x(x_a, x), (b, p).
fn cross_with_basis(
    posterior: &Posterior<MultiTaskCovariance>,
    row: &TaskRow,
    x: MatRef<'_, f64>,
) -> Mat<f64> {
    let (points, tasks) = points_of(posterior);
    let prior = posterior.covariance();
    let known = prior.task().rows();
    let loading: Vec<f64> = known.iter().map(|known| row.dot(&known.entries)).collect();
    let mut cross = prior.input().cross(points, x);
    for col in 0..cross.ncols() {
        for (value, task) in cross.col_as_slice_mut(col).iter_mut().zip(&tasks) {
            *value *= loading[*task];
        }
    }
    cross
}
