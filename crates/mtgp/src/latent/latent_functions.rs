//! The latent functions of eq. (16) at new inputs, conditioned on the data of all tasks.

use faer::{Mat, MatRef};
use gp_core::Posterior;
use gp_core::data::require_inputs;
use kernels::Covariance;
use linalg::mirror;

use crate::error::MtgpError;
use crate::latent::predictive::PredictiveDensity;
use crate::latent::whitening::{add_transposed_product, points_of};
use crate::prior::{MultiTaskCovariance, TaskRow};

/// Posterior of the r latent functions at k new inputs: all that any task's torques there need.
///
/// Eq. (16) with K^ρ = ΛΛᵀ says that task γ is τ^γ = Σ_c Λ_γc f_c with independent f_c of
/// covariance c^x. Given the data D of all tasks, the f_c are jointly Gaussian:
/// ```text
/// M_c = K_Bcᵀ β,   S_cc′ = δ_cc′ c^x(X*, X*) − K_Bcᵀ P K_Bc′      (K_Bc)_aj = Λ_γ(a)c c^x(x_a, x*_j)
/// ```
/// with β and P as the posterior has them. A task with row λ, learned or not, then has
/// ```text
/// t* | D, λ ~ N(Mλ, Σ_cc′ λ_c λ_c′ S_cc′ + s² c^x(X*, X*) + σ²I)
/// ```
/// so that the n samples are visited once, not once for each task or each λ that is tried.
/// # Shapes
/// Time O(n² r k + n r² k²) once, memory (n + r k) r k; afterwards O(r² k² + k³) per row λ.
/// # Source
/// Section 5 of the chapter asks for densities of contexts and for rows of new ones;
/// the conditioning is eqs. (3)–(4) for linear functions of the data.
#[derive(Debug, Clone)]
pub struct LatentFunctions {
    /// M, (k, r).
    mean: Mat<f64>,
    /// S, (rk, rk), block (c, c′) at rows ck.. and columns c′k.., symmetric to the bit.
    covariance: Mat<f64>,
    /// c^x(X*, X*), (k, k), symmetric.
    prior: Mat<f64>,
    noise_std: f64,
}

impl LatentFunctions {
    /// Conditions the latent functions at the rows of `x`.
    ///
    /// # Shapes
    /// `x` (k, d), without a column for the task.
    /// # Errors
    /// [`gp_core::GpError::WrongCovariates`] or [`gp_core::GpError::NonFiniteInput`].
    pub fn new(
        posterior: &Posterior<MultiTaskCovariance>,
        x: MatRef<'_, f64>,
    ) -> Result<Self, MtgpError> {
        let (points, tasks) = points_of(posterior);
        require_inputs(x, points.ncols())?;
        let input = posterior.covariance().input();
        let root = posterior.covariance().task().root();
        let (k, rank) = (x.nrows(), root.ncols());

        let k_bx = input.cross(points, x); // (b, k)
        let cross = Mat::from_fn(points.nrows(), rank * k, |a, col| {
            root[(tasks[a], col / k)] * k_bx[(a, col % k)]
        });
        let mut prior = input.gram(x); // (k, k)
        mirror(&mut prior);
        let mut covariance = Mat::zeros(rank * k, rank * k);
        for first in (0..rank * k).step_by(k.max(1)) {
            let block = covariance.as_mut().submatrix_mut(first, first, k, k);
            { block }.copy_from(&prior);
        }

        let mut stacked = vec![0.0; rank * k];
        let weights = &posterior.basis().weights;
        add_transposed_product(cross.as_ref(), weights, &mut stacked);
        posterior.condition_covariance(cross, &mut covariance);
        Ok(Self {
            mean: Mat::from_fn(k, rank, |row, c| stacked[c * k + row]),
            covariance,
            prior,
            noise_std: posterior.noise_std(),
        })
    }

    /// The same for new torques whose noise is correlated, c of which tell as much as one: σ √c instead of σ.
    ///
    /// # Panics
    /// If c is not at least 1.
    #[must_use]
    pub fn of_correlated(self, correlation: f64) -> Self {
        assert!(correlation >= 1.0, "{correlation} torques for one");
        Self {
            noise_std: self.noise_std * correlation.sqrt(),
            ..self
        }
    }

    /// Number of inputs k.
    pub fn n_points(&self) -> usize {
        self.mean.nrows()
    }

    /// Number of latent functions r.
    pub fn rank(&self) -> usize {
        self.mean.ncols()
    }

    /// M, (k, r).
    pub fn mean(&self) -> MatRef<'_, f64> {
        self.mean.as_ref()
    }

    /// S_cc′, (k, k).
    ///
    /// # Panics
    /// If there are no such latent functions.
    pub fn covariance(&self, c: usize, other: usize) -> MatRef<'_, f64> {
        let k = self.n_points();
        self.covariance.submatrix(c * k, other * k, k, k)
    }

    /// c^x(X*, X*), (k, k): the covariance of a function of which nothing is known.
    pub fn prior(&self) -> MatRef<'_, f64> {
        self.prior.as_ref()
    }

    /// Noise standard deviation σ of the new torques, in target units.
    pub fn noise_std(&self) -> f64 {
        self.noise_std
    }

    /// Mλ, (k,).
    ///
    /// # Panics
    /// If there are not r entries.
    pub fn mean_of(&self, entries: &[f64]) -> Vec<f64> {
        assert_eq!(entries.len(), self.rank());
        let mut mean = vec![0.0; self.n_points()];
        add_transposed_product(self.mean.transpose(), entries, &mut mean);
        mean
    }

    /// Σ_c′ λ_c′ S_cc′ for one c, (k, k), which is not symmetric.
    pub(crate) fn mixed(&self, c: usize, entries: &[f64]) -> Mat<f64> {
        let mut sum = Mat::zeros(self.n_points(), self.n_points());
        for (other, entry) in entries.iter().enumerate() {
            sum += faer::Scale(*entry) * self.covariance(c, other);
        }
        sum
    }

    /// Posterior covariance of the latent torques of a task, (k, k), symmetric to rounding.
    ///
    /// ```text
    /// Σ_cc′ λ_c λ_c′ S_cc′ + s² c^x(X*, X*)
    /// ```
    /// # Panics
    /// If there are not r entries.
    pub fn covariance_of(&self, row: &TaskRow) -> Mat<f64> {
        assert_eq!(row.entries.len(), self.rank());
        let mut sum = faer::Scale(row.own_std * row.own_std) * &self.prior;
        for (c, entry) in row.entries.iter().enumerate() {
            sum += faer::Scale(*entry) * self.mixed(c, &row.entries);
        }
        sum
    }

    /// The density of new torques of a task.
    ///
    /// # Errors
    /// [`MtgpError::CountMismatch`] or [`MtgpError::NonFinite`] unless the row has r finite
    /// entries; as for [`PredictiveDensity::new`].
    pub fn density(&self, row: &TaskRow) -> Result<PredictiveDensity, MtgpError> {
        self.density_with_noise(row, 0.0)
    }

    /// The density of new torques whose noise is greater than σ, by an independent part.
    ///
    /// # Errors
    /// As for [`LatentFunctions::density`].
    pub fn density_with_noise(
        &self,
        row: &TaskRow,
        noise_std: f64,
    ) -> Result<PredictiveDensity, MtgpError> {
        row.require(self.rank())?;
        let mean = self.mean_of(&row.entries);
        let total = self.noise_std.hypot(noise_std);
        PredictiveDensity::new(mean, self.covariance_of(row), total)
    }
}
