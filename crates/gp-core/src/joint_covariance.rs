//! The posterior covariance between several new points: the matrix form of eq. (4).

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatRef, Par};
use kernels::Covariance;

use crate::data::require_finite_inputs;
use crate::error::GpError;
use crate::fit_posterior::FitPosterior;
use crate::low_rank_posterior::LowRankPosterior;
use crate::posterior::Posterior;

impl<C: Covariance> Posterior<C> {
    /// Posterior covariance of the latent torques at the rows of `x`, symmetric, (k, k).
    ///
    /// ```text
    /// cov(x*) = c(X*, X*) − VᵀV,   V = L⁻¹ c(X, X*)        K = LLᵀ
    /// ```
    /// Its diagonal is that of [`Posterior::predict_var`], never negative.
    /// Add σ² to the diagonal for new observations.
    /// Takes the memory of an (n, k) and of two (k, k) matrices.
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Source
    /// Eq. (4) in matrix form; Rasmussen & Williams 2006, eq. (2.24).
    pub fn predict_covariance(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, GpError> {
        require_points(x, self.x().ncols())?;
        let mut known = self.covariance().cross(self.x(), x); // (n, k)
        self.factor().half_solve_in_place(known.as_mut());
        let mut covariance = self.covariance().gram(x); // (k, k)
        add_inner_product(&mut covariance, -1.0, known.as_ref());
        lift_diagonal(&mut covariance);
        Ok(covariance)
    }
}

impl<C: Covariance> LowRankPosterior<C> {
    /// Posterior covariance of the latent torques at the rows of `x`, symmetric, (k, k).
    ///
    /// ```text
    /// cov(x*) = c(X*, X*) − ΦᵀΦ + σ² (R⁻ᵀΦ)ᵀ(R⁻ᵀΦ),   Φ = L_P⁻¹ c(x_P, X*)
    /// ```
    /// Its diagonal is that of [`LowRankPosterior::predict`], never negative.
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Source
    /// As for [`LowRankPosterior`], in matrix form.
    pub fn predict_covariance(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, GpError> {
        let parts = self.parts();
        require_points(x, parts.pivots.ncols())?;
        let mut phi = self.covariance().cross(parts.pivots.as_ref(), x); // (r, k)
        solve_lower_triangular_in_place(parts.pivot_factor.as_ref(), phi.as_mut(), Par::Seq);
        let mut covariance = self.covariance().gram(x); // (k, k)
        add_inner_product(&mut covariance, -1.0, phi.as_ref());
        lift_diagonal(&mut covariance);

        solve_lower_triangular_in_place(parts.noise_factor.transpose(), phi.as_mut(), Par::Seq);
        let noise_var = self.noise_std() * self.noise_std();
        add_inner_product(&mut covariance, noise_var, phi.as_ref());
        Ok(covariance)
    }
}

impl<C: Covariance> FitPosterior<C> {
    /// Posterior covariance of the latent torques at the rows of `x`, symmetric, (k, k).
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_covariance(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, GpError> {
        match self {
            Self::Dense(posterior) => posterior.predict_covariance(x),
            Self::LowRank(posterior) => posterior.predict_covariance(x),
        }
    }
}

fn require_points(x: MatRef<'_, f64>, expected: usize) -> Result<(), GpError> {
    if x.ncols() != expected {
        let found = x.ncols();
        return Err(GpError::WrongCovariates { found, expected });
    }
    require_finite_inputs(x)
}

/// out += factor · vᵀv, with both triangles equal to the bit.
fn add_inner_product(out: &mut Mat<f64>, factor: f64, v: MatRef<'_, f64>) {
    matmul(out.as_mut(), Accum::Add, v.transpose(), v, factor, Par::Seq);
    for col in 1..out.ncols() {
        for row in 0..col {
            out[(row, col)] = out[(col, row)];
        }
    }
}

/// Sets variances that rounding took below zero to zero.
fn lift_diagonal(covariance: &mut Mat<f64>) {
    for idx in 0..covariance.nrows() {
        if covariance[(idx, idx)] < 0.0 {
            covariance[(idx, idx)] = 0.0;
        }
    }
}
