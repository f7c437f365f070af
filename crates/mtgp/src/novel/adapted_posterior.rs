//! Predictions of all contexts, the new one among them, from the old data and its own.

use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatRef, Par};
use gp_core::{Posterior, Prediction};
use kernels::Covariance;
use linalg::Factor;

use crate::context::ContextModel;
use crate::error::{MtgpError, require_inputs};
use crate::latent::{LatentFunctions, PredictiveDensity, require_torques};
use crate::latent::{add_inner_product, add_transposed_product, mirror, points_of};
use crate::novel::row::NewTorques;
use crate::prior::{MultiTaskCovariance, TaskRow};

/// Test points that are worked on together: bounds the memory to (n, `BLOCK`).
const BLOCK: usize = 128;

/// A posterior of m contexts, conditioned further on torques of a context m that it does not have.
///
/// ```text
/// A = cov_D(t*, t*) + σ²I = L_A L_Aᵀ,   α* = A⁻¹(t* − mean_D(X*))
/// mean(f) = mean_D(f) + cov_D(f, t*) α*
/// cov(f, g) = cov_D(f, g) − cov_D(f, t*) A⁻¹ cov_D(t*, g)
/// ```
/// which is the posterior given D ∪ D* with Λ grown by the row λ (and a column for s): the same
/// as if all samples had been conditioned on at once, but no matrix of order n is factorised
/// again. With G = P c(B, t*) as the posterior has P, cov_D(f, t*) = c(f, t*) − c(f, B)G, and a
/// mean takes O(n + k).
/// # Source
/// Section 5: inference with the grown K^ρ; eqs. (3)–(4) applied to D and then to D*.
#[derive(Debug, Clone)]
pub struct AdaptedPosterior {
    posterior: Posterior<MultiTaskCovariance>,
    /// Rows of all contexts, the new one last, (m + 1,).
    rows: Vec<TaskRow>,
    x: Mat<f64>,
    explained: Mat<f64>, // G, (b, k)
    weights: Vec<f64>,   // β − Gα*, (b,)
    alpha: Vec<f64>,     // α*, (k,)
    factor: Factor,
}

impl AdaptedPosterior {
    /// Conditions on the torques of a new context with a given row.
    ///
    /// # Shapes
    /// `x` (k, d), without a column for the task; `torques` (k,), N·m.
    /// # Errors
    /// Shapes and numbers of inputs, torques and row as for [`crate::novel::log_density_of_row`] and
    /// [`LatentFunctions::new`]; [`gp_core::GpError::NotPositiveDefinite`].
    pub fn new(
        posterior: Posterior<MultiTaskCovariance>,
        row: TaskRow,
        x: MatRef<'_, f64>,
        torques: &[f64],
    ) -> Result<Self, MtgpError> {
        let latent = LatentFunctions::new(&posterior, x)?;
        let torques = NewTorques {
            latent: &latent,
            torques,
        };
        Self::from_latent(posterior, row, x, torques)
    }

    /// As above, with the latent functions that the row was learned by.
    ///
    /// # Errors
    /// As above.
    /// # Panics
    /// If the latent functions are not those at the rows of `x`.
    pub fn from_latent(
        posterior: Posterior<MultiTaskCovariance>,
        row: TaskRow,
        x: MatRef<'_, f64>,
        new: NewTorques<'_>,
    ) -> Result<Self, MtgpError> {
        let latent = new.latent;
        assert_eq!(latent.n_points(), x.nrows());
        require_torques(new.torques, latent.n_points())?;
        let density = latent.density(&row)?;
        let residual: Vec<f64> = (new.torques.iter().zip(density.mean()))
            .map(|(torque, mean)| torque - mean)
            .collect();
        let alpha = density.factor().solve(&residual);

        let basis = posterior.basis();
        require_inputs(x, points_of(&posterior).0.ncols())?;
        let mut explained = cross_with_basis(&posterior, &row, x); // (b, k)
        basis.solve_in_place(posterior.noise_std(), &mut explained);
        let mut correction = vec![0.0; explained.nrows()];
        add_transposed_product(explained.transpose(), &alpha, &mut correction);
        let weights = basis.weights.iter().zip(correction);
        let weights = weights.map(|(weight, part)| weight - part).collect();

        let mut rows = posterior.covariance().task().rows();
        rows.push(row);
        Ok(Self {
            factor: density.factor().clone(),
            x: x.to_owned(),
            posterior,
            rows,
            explained,
            weights,
            alpha,
        })
    }

    /// Number of contexts m + 1.
    pub fn n_contexts(&self) -> usize {
        self.rows.len()
    }

    /// The number m of the new context.
    pub fn new_context(&self) -> usize {
        self.rows.len() - 1
    }

    /// The row of the new context.
    pub fn new_row(&self) -> &TaskRow {
        &self.rows[self.new_context()]
    }

    /// The posterior given the old data.
    pub fn posterior(&self) -> &Posterior<MultiTaskCovariance> {
        &self.posterior
    }

    /// States of the new torques, (k, d).
    pub fn x(&self) -> MatRef<'_, f64> {
        self.x.as_ref()
    }

    /// Posterior means of a context's torques, in target units.
    ///
    /// # Shapes
    /// `x` (p, d), without a column for the task.
    /// # Errors
    /// [`MtgpError::UnknownTask`]; [`gp_core::GpError::WrongCovariates`] or
    /// [`gp_core::GpError::NonFiniteInput`].
    pub fn predict_mean(&self, x: MatRef<'_, f64>, context: usize) -> Result<Vec<f64>, MtgpError> {
        let mut mean = Vec::with_capacity(x.nrows());
        self.for_each_block(x, context, |_, k_bf, c_sf| {
            mean.extend(self.means_from(k_bf, c_sf));
        })?;
        Ok(mean)
    }

    /// Posterior means and latent variances of a context's torques.
    ///
    /// # Shapes
    /// `x` (p, d), without a column for the task.
    /// # Errors
    /// As for [`AdaptedPosterior::predict_mean`].
    pub fn predict(&self, x: MatRef<'_, f64>, context: usize) -> Result<Prediction, MtgpError> {
        let (mut mean, mut var) = (Vec::new(), Vec::new());
        self.for_each_block(x, context, |x_block, k_bf, c_sf| {
            mean.extend(self.means_from(k_bf, c_sf));
            var.extend(self.variances(x_block, context, k_bf, c_sf));
        })?;
        let mut n_clamped = 0;
        for value in var.iter_mut().filter(|value| **value < 0.0) {
            *value = 0.0;
            n_clamped += 1;
        }
        Ok(Prediction {
            mean,
            var,
            n_clamped,
        })
    }

    /// Posterior covariance of the latent torques of a context, symmetric, (p, p).
    ///
    /// # Errors
    /// As for [`AdaptedPosterior::predict_mean`].
    pub fn predict_covariance(
        &self,
        x: MatRef<'_, f64>,
        context: usize,
    ) -> Result<Mat<f64>, MtgpError> {
        self.require(x, context)?;
        let row = &self.rows[context];
        let k_bf = cross_with_basis(&self.posterior, row, x);
        let half = self.half_solved(&k_bf, self.cross_with_new(x, context));
        let mut covariance = LatentFunctions::new(&self.posterior, x)?.covariance_of(row);
        add_inner_product(&mut covariance, -1.0, half.as_ref());
        for idx in 0..covariance.nrows() {
            if covariance[(idx, idx)] < 0.0 {
                covariance[(idx, idx)] = 0.0;
            }
        }
        mirror(&mut covariance);
        Ok(covariance)
    }

    fn require(&self, x: MatRef<'_, f64>, context: usize) -> Result<(), MtgpError> {
        let n_tasks = self.n_contexts();
        if context >= n_tasks {
            return Err(MtgpError::UnknownTask {
                row: 0,
                task: context,
                n_tasks,
            });
        }
        require_inputs(x, self.x.ncols())
    }

    /// Visits the test points in blocks, with c(B, f), (b, block), and c(t*, f), (k, block).
    fn for_each_block(
        &self,
        x: MatRef<'_, f64>,
        context: usize,
        mut visit: impl FnMut(MatRef<'_, f64>, &Mat<f64>, &Mat<f64>),
    ) -> Result<(), MtgpError> {
        self.require(x, context)?;
        for first in (0..x.nrows()).step_by(BLOCK) {
            let block = x.subrows(first, BLOCK.min(x.nrows() - first));
            let k_bf = cross_with_basis(&self.posterior, &self.rows[context], block);
            visit(block, &k_bf, &self.cross_with_new(block, context));
        }
        Ok(())
    }

    /// c(t*, f), (k, p).
    fn cross_with_new(&self, x: MatRef<'_, f64>, context: usize) -> Mat<f64> {
        let (new, row) = (self.new_row(), &self.rows[context]);
        let is_same = context == self.new_context();
        let own_var = if is_same {
            new.own_std * new.own_std
        } else {
            0.0
        };
        let input = self.posterior.covariance().input();
        faer::Scale(new.dot(&row.entries) + own_var) * input.cross(self.x(), x)
    }

    /// c(f, B)(β − Gα*) + c(f, t*)α*
    fn means_from(&self, k_bf: &Mat<f64>, c_sf: &Mat<f64>) -> Vec<f64> {
        let mut mean = vec![0.0; k_bf.ncols()];
        add_transposed_product(k_bf.as_ref(), &self.weights, &mut mean);
        add_transposed_product(c_sf.as_ref(), &self.alpha, &mut mean);
        mean
    }

    /// L_A⁻¹ cov_D(t*, f), (k, p), from c(t*, f).
    fn half_solved(&self, k_bf: &Mat<f64>, mut c_sf: Mat<f64>) -> Mat<f64> {
        faer::linalg::matmul::matmul(
            c_sf.as_mut(),
            faer::Accum::Add,
            self.explained.transpose(),
            k_bf.as_ref(),
            -1.0,
            faer::Par::Seq,
        );
        self.factor.half_solve_in_place(c_sf.as_mut());
        c_sf
    }

    /// var_D(f) − |L_A⁻¹ cov_D(t*, f)|²
    fn variances(
        &self,
        x: MatRef<'_, f64>,
        context: usize,
        k_bf: &Mat<f64>,
        c_sf: &Mat<f64>,
    ) -> Vec<f64> {
        let row = &self.rows[context];
        let prior = self.posterior.covariance().input().diag(x);
        let own = row.dot(&row.entries) + row.own_std * row.own_std;
        let mut variances: Vec<f64> = prior.iter().map(|prior| own * prior).collect();
        condition_variances(&self.posterior, k_bf.clone(), &mut variances);
        let half = self.half_solved(k_bf, c_sf.clone());
        for (variance, column) in variances.iter_mut().zip(half.col_iter()) {
            *variance -= column.squared_norm_l2();
        }
        variances
    }
}

/// c(f, f) → var_D(f) for every column c(B, f) of `cross`, which rounding can take below zero.
///
/// # Shapes
/// `cross` (b, p); `variances` (p,).
fn condition_variances(
    posterior: &Posterior<MultiTaskCovariance>,
    mut cross: Mat<f64>,
    variances: &mut [f64],
) {
    let basis = posterior.basis();
    basis.factor.half_solve_in_place(cross.as_mut());
    for (variance, column) in variances.iter_mut().zip(cross.col_iter()) {
        *variance -= column.squared_norm_l2();
    }
    if let Some(r) = &basis.noise_factor {
        let noise_var = posterior.noise_std() * posterior.noise_std();
        solve_lower_triangular_in_place(r.transpose(), cross.as_mut(), Par::Seq);
        for (variance, column) in variances.iter_mut().zip(cross.col_iter()) {
            // The comparison lets NaN through, which f64::max would turn into certainty.
            let unexplained = if *variance < 0.0 { 0.0 } else { *variance };
            *variance = unexplained + noise_var * column.squared_norm_l2();
        }
    }
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

/// The contexts are the m known ones and then the new one.
impl ContextModel for AdaptedPosterior {
    fn n_contexts(&self) -> usize {
        self.rows.len()
    }

    fn predictive_densities(
        &self,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<PredictiveDensity>, MtgpError> {
        let density = |context| {
            let mean = self.predict_mean(x, context)?;
            let covariance = self.predict_covariance(x, context)?;
            PredictiveDensity::new(mean, covariance, self.posterior.noise_std())
        };
        (0..self.rows.len()).map(density).collect()
    }
}
