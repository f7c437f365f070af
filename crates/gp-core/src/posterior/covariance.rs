//! The posterior covariance between several new points: the matrix form of eq. (4).

use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, MatRef, Par};
use kernels::Covariance;
use linalg::{add_inner_product, mirror};

use crate::error::GpError;
use crate::posterior::condition::Posterior;

impl<C: Covariance> Posterior<C> {
    /// Posterior covariance of the latent torques at the rows of `x`, symmetric, (k, k).
    ///
    /// ```text
    /// cov(x*) = c(X*, X*) − ΦᵀΦ,   Φ = L⁻¹ c(B, X*)          samples as B
    /// cov(x*) = c(X*, X*) − ΦᵀΦ + σ² (R⁻ᵀΦ)ᵀ(R⁻ᵀΦ)           pivots as B
    /// ```
    /// Its diagonal is that of [`Posterior::predict_var`], never negative.
    /// Add σ² to the diagonal for new observations.
    /// Takes the memory of a (b, k) and of two (k, k) matrices.
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Source
    /// Eq. (4) in matrix form; Rasmussen & Williams 2006, eq. (2.24).
    pub fn predict_covariance(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, GpError> {
        self.require_points(x)?;
        let cross = self.covariance().cross(self.basis().points.as_ref(), x); // (b, k)
        let mut covariance = self.covariance().gram(x); // (k, k)
        self.condition_covariance(cross, &mut covariance);
        Ok(covariance)
    }

    /// c(F, F) → cov(F, F) with both triangles equal to the bit, from `cross` = c(B, F).
    ///
    /// For any values F of the process, whether or not the posterior has a row for them.
    /// # Shapes
    /// `cross` (b, p); `covariance` (p, p), read below its diagonal.
    /// # Panics
    /// On other shapes.
    pub fn condition_covariance(&self, mut cross: Mat<f64>, covariance: &mut Mat<f64>) {
        self.basis().factor.half_solve_in_place(cross.as_mut());
        add_inner_product(covariance, -1.0, cross.as_ref());
        // What the points leave unexplained is never negative: rounding must not make it so.
        for idx in 0..covariance.nrows() {
            if covariance[(idx, idx)] < 0.0 {
                covariance[(idx, idx)] = 0.0; // f64::max would turn NaN into certainty
            }
        }
        if let Some(r) = &self.basis().noise_factor {
            solve_lower_triangular_in_place(r.transpose(), cross.as_mut(), Par::Seq);
            let noise_var = self.noise_std() * self.noise_std();
            add_inner_product(covariance, noise_var, cross.as_ref());
        }
        mirror(covariance);
    }
}
