//! What a posterior has learned, for covariances with functions that its own rows do not name.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, ColMut, Mat, MatRef, Par};
use gp_core::{Factor, FitPosterior, LowRankParts};

use crate::error::MtgpError;
use crate::prior::{MultiTaskCovariance, split};
use crate::sequential::product;
use crate::triangular_rows::TriangularRows;

/// The points that a posterior is expressed in, with its factors there.
///
/// ```text
/// mean_D(f) = c(f, B) β
/// cov_D(f, g) = c(f, g) − c(f, B) P c(B, g)
/// samples as B:  P = K⁻¹ = L⁻ᵀL⁻¹           pivots as B:  P = L_P⁻ᵀ (I − σ²R⁻¹R⁻ᵀ) L_P⁻¹
/// ```
/// for any values f, g of the process, whether or not the posterior has a row for them.
/// # Source
/// Eqs. (3)–(4); for pivots as for [`gp_core::LowRankPosterior`].
pub(crate) struct Basis<'a> {
    prior: &'a MultiTaskCovariance,
    rows: MatRef<'a, f64>,
    weights: &'a [f64],
    factors: Factors<'a>,
}

enum Factors<'a> {
    Samples(&'a Factor),
    Pivots(&'a LowRankParts),
}

impl<'a> Basis<'a> {
    pub fn of(posterior: &'a FitPosterior<MultiTaskCovariance>) -> Self {
        let prior = posterior.covariance();
        match posterior {
            FitPosterior::Dense(dense) => Self {
                prior,
                rows: dense.x(),
                weights: dense.alpha(),
                factors: Factors::Samples(dense.factor()),
            },
            FitPosterior::LowRank(low_rank) => Self {
                prior,
                rows: low_rank.parts().pivots.as_ref(),
                weights: &low_rank.parts().weights,
                factors: Factors::Pivots(low_rank.parts()),
            },
        }
    }

    /// The covariates of B, (b, d), and their tasks, (b,).
    pub fn points(&self) -> (MatRef<'a, f64>, Vec<usize>) {
        split(self.rows, self.prior.n_tasks())
    }

    /// β, (b,).
    pub fn weights(&self) -> &'a [f64] {
        self.weights
    }

    /// L or L_P, (b, b), lower triangular.
    pub fn l(&self) -> MatRef<'a, f64> {
        match self.factors {
            Factors::Samples(factor) => factor.l(),
            Factors::Pivots(parts) => parts.pivot_factor.as_ref(),
        }
    }

    /// R and σ² of pivots.
    pub fn pivot_noise(&self) -> Option<(MatRef<'a, f64>, f64)> {
        match self.factors {
            Factors::Samples(_) => None,
            Factors::Pivots(parts) => {
                let noise_var = parts.noise_std * parts.noise_std;
                Some((parts.noise_factor.as_ref(), noise_var))
            }
        }
    }

    /// T with cov_D(f, g) = c(f, g) − (T c(B, f))ᵀ (T c(B, g)), lower triangular.
    ///
    /// ```text
    /// samples as B:  T = L⁻¹
    /// pivots as B:   T = N L_P⁻¹,   NᵀN = I − σ²R⁻¹R⁻ᵀ,   N lower triangular
    /// ```
    /// N is the Cholesky factor of its matrix with rows and columns in reverse order, transposed and
    /// put back in order. Where rounding has made the matrix indefinite, the identity counts as
    /// (1 + b²ε) I: variances then come out smaller by b²ε c(f, f) at most.
    /// # Errors
    /// [`gp_core::GpError::NotPositiveDefinite`] if a factor is not finite.
    pub fn whitening(&self) -> Result<TriangularRows, MtgpError> {
        let order = self.weights.len();
        let mut inverse = Mat::identity(order, order); // L⁻¹
        solve_lower_triangular_in_place(self.l(), inverse.as_mut(), Par::Seq);
        let Some((r, noise_var)) = self.pivot_noise() else {
            return Ok(TriangularRows::lower(inverse.as_ref()));
        };
        let mut half = Mat::identity(order, order); // R⁻ᵀ
        solve_lower_triangular_in_place(r.transpose(), half.as_mut(), Par::Seq);
        let last = order.saturating_sub(1);
        // The matrix of N in reverse order, with `one` for the diagonal of the identity.
        let reversed = |one: f64| {
            let mut known = faer::Scale(one) * Mat::<f64>::identity(order, order);
            add_inner_product(&mut known, -noise_var, half.as_ref());
            Mat::from_fn(order, order, |row, col| known[(last - row, last - col)])
        };
        let above_one = 1.0 + (order * order) as f64 * f64::EPSILON;
        let factor = Factor::new(reversed(1.0)).or_else(|_| Factor::new(reversed(above_one)))?;
        let l = factor.l();
        let n = Mat::from_fn(order, order, |row, col| {
            if col <= row {
                l[(last - col, last - row)]
            } else {
                0.0
            }
        });
        Ok(TriangularRows::lower(
            product(n.as_ref(), inverse.as_ref()).as_ref(),
        ))
    }

    /// c(F, F) → cov_D(F, F) with both triangles equal to the bit, from `cross` = c(B, F).
    ///
    /// # Shapes
    /// `cross` (b, p); `covariance` (p, p), read below its diagonal.
    pub fn condition(&self, mut cross: Mat<f64>, covariance: &mut Mat<f64>) {
        solve_lower_triangular_in_place(self.l(), cross.as_mut(), Par::Seq);
        add_inner_product(covariance, -1.0, cross.as_ref());
        // What the pivots leave unexplained is never negative: rounding must not make it so.
        for idx in 0..covariance.nrows() {
            if covariance[(idx, idx)] < 0.0 {
                covariance[(idx, idx)] = 0.0; // f64::max would turn NaN into certainty
            }
        }
        if let Some((r, noise_var)) = self.pivot_noise() {
            solve_lower_triangular_in_place(r.transpose(), cross.as_mut(), Par::Seq);
            add_inner_product(covariance, noise_var, cross.as_ref());
        }
        mirror(covariance);
    }

    /// c(f, f) → var_D(f) for every column c(B, f) of `cross`, which rounding can take below zero.
    ///
    /// # Shapes
    /// `cross` (b, p); `variances` (p,).
    pub fn condition_variances(&self, mut cross: Mat<f64>, variances: &mut [f64]) {
        solve_lower_triangular_in_place(self.l(), cross.as_mut(), Par::Seq);
        for (variance, column) in variances.iter_mut().zip(cross.col_iter()) {
            *variance -= column.squared_norm_l2();
        }
        if let Some((r, noise_var)) = self.pivot_noise() {
            solve_lower_triangular_in_place(r.transpose(), cross.as_mut(), Par::Seq);
            for (variance, column) in variances.iter_mut().zip(cross.col_iter()) {
                // The comparison lets NaN through, which f64::max would turn into certainty.
                let unexplained = if *variance < 0.0 { 0.0 } else { *variance };
                *variance = unexplained + noise_var * column.squared_norm_l2();
            }
        }
    }

    /// P c(B, F) in place of `cross` = c(B, F), (b, p).
    pub fn solve_in_place(&self, cross: &mut Mat<f64>) {
        solve_lower_triangular_in_place(self.l(), cross.as_mut(), Par::Seq);
        if let Some((r, noise_var)) = self.pivot_noise() {
            let mut part = cross.clone();
            solve_lower_triangular_in_place(r.transpose(), part.as_mut(), Par::Seq);
            solve_upper_triangular_in_place(r, part.as_mut(), Par::Seq);
            *cross -= faer::Scale(noise_var) * part;
        }
        solve_upper_triangular_in_place(self.l().transpose(), cross.as_mut(), Par::Seq);
    }
}

/// out += factor · vᵀv
pub(crate) fn add_inner_product(out: &mut Mat<f64>, factor: f64, v: MatRef<'_, f64>) {
    matmul(out.as_mut(), Accum::Add, v.transpose(), v, factor, Par::Seq);
}

/// Copies the lower triangle to the upper one.
pub(crate) fn mirror(matrix: &mut Mat<f64>) {
    for col in 1..matrix.ncols() {
        for row in 0..col {
            matrix[(row, col)] = matrix[(col, row)];
        }
    }
}

/// out += aᵀv
pub(crate) fn add_transposed_product(a: MatRef<'_, f64>, v: &[f64], out: &mut [f64]) {
    let v = faer::ColRef::from_slice(v).as_mat();
    let out = ColMut::from_slice_mut(out).as_mat_mut();
    matmul(out, Accum::Add, a.transpose(), v, 1.0, Par::Seq);
}
