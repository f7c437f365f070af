//! A posterior conditioned on further samples, without factorising again what it is conditioned on.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, ColMut, Mat, MatRef, Par};
use kernels::{Covariance, Jitter};
use linalg::{Factor, add_inner_product, upper_of};

use crate::data::{require_noise, require_training_data};
use crate::error::GpError;
use crate::evidence::{Choice, independent_rows, rows};
use crate::posterior::basis::Basis;
use crate::posterior::condition::Posterior;

impl<C: Covariance + Clone> Posterior<C> {
    /// The posterior given the samples that it has and k more, with the same hyperparameters.
    ///
    /// By whichever path it has: O(n²k) for n samples, O(r²k) for r pivots, to which the new inputs
    /// are added, so that nothing of the new samples is lost beyond rounding.
    /// # Shapes
    /// `x` (k, d); `targets` (k,).
    /// # Errors
    /// [`GpError::WrongCovariates`]; data that is not finite or does not match; a matrix that is not
    /// positive definite.
    /// # Source
    /// Eqs. (3)–(4), applied to the old samples and then to the new.
    pub fn with_samples(&self, x: MatRef<'_, f64>, targets: &[f64]) -> Result<Self, GpError> {
        self.with_samples_of_noise(x, targets, self.noise_std())
    }

    /// The same where the noise of the new samples has a standard deviation of its own, in target units.
    ///
    /// σ stays that of a further observation. [`Posterior::on_pivots`] of such a posterior takes all samples to have σ.
    /// # Errors
    /// As for [`Posterior::with_samples`]; [`GpError::BadNoise`] unless the noise is positive.
    pub fn with_samples_of_noise(
        &self,
        x: MatRef<'_, f64>,
        targets: &[f64],
        noise_std: f64,
    ) -> Result<Self, GpError> {
        require_training_data(x, targets, 1)?;
        require_noise(noise_std)?;
        let residuals: Vec<f64> = (targets.iter().zip(self.predict_mean(x)?))
            .map(|(target, mean)| target - mean)
            .collect();
        let basis = match &self.basis().noise_factor {
            None => on_samples(self, x, &residuals, noise_std)?,
            Some(r) => on_pivots(self, r, x, &residuals, noise_std)?,
        };
        Self::from_parts(self.covariance().clone(), self.noise_std(), basis)
    }
}

/// By the factor of all samples.
///
/// ```text
/// H = L⁻¹ c(X, X*),   A = c(X*, X*) + σ*²I − HᵀH = L_A L_Aᵀ,   α* = A⁻¹(t* − mean(X*))
/// L′ = [L 0; Hᵀ L_A],   α′ = (α − L⁻ᵀHα*, α*)
/// ```
fn on_samples<C: Covariance>(
    posterior: &Posterior<C>,
    x: MatRef<'_, f64>,
    residuals: &[f64],
    noise_std: f64,
) -> Result<Basis, GpError> {
    let (old, covariance) = (posterior.basis(), posterior.covariance());
    let (n, k) = (old.rank(), x.nrows());
    let mut half = covariance.cross(old.points.as_ref(), x); // H, (n, k)
    old.factor.half_solve_in_place(half.as_mut());
    let mut schur = covariance.gram(x);
    Jitter::new(noise_std)?.add_gram(x, schur.as_mut());
    add_inner_product(&mut schur, -1.0, half.as_ref());
    let corner = Factor::new(schur)?;

    let new_alpha = corner.solve(residuals);
    let mut correction = product(half.as_ref(), &new_alpha);
    let l = old.factor.l();
    solve_upper_in_place(l.transpose(), &mut correction);
    let alpha = (old.weights.iter().zip(correction))
        .map(|(alpha, part)| alpha - part)
        .chain(new_alpha.iter().copied());

    let l_new = corner.l();
    let l_all = Mat::from_fn(n + k, n + k, |row, col| match (row < n, col < n) {
        _ if col > row => 0.0,
        (true, _) => l[(row, col)],
        (false, true) => half[(col, row - n)],
        (false, false) => l_new[(row - n, col - n)],
    });
    Ok(Basis {
        points: stacked(old.points.as_ref(), x),
        weights: alpha.collect(),
        factor: Factor::from_lower(l_all),
        noise_factor: None,
    })
}

/// By pivots: the new inputs whose remainder of the prior variance is more than rounding join them.
///
/// With a standard normal weight for every entry of φ, and Φ* = L_P⁻¹ c(x_P, X*):
/// ```text
/// E = c(X*, X*) − Φ*ᵀΦ*,   L_E L_Eᵀ = E of the new pivots,   Ψ* = L_E⁻¹ E of them with all
/// L_P′ = [L_P 0; Φ*ᵀ L_E],   Φ′ = σ/σ* (Φ*; Ψ*),   R′ᵀR′ = diag(RᵀR, σ²I) + Φ′Φ′ᵀ
/// β′ = (β, 0) + L_P′⁻ᵀ (R′ᵀR′)⁻¹ Φ′ σ/σ* (t* − mean(X*))
/// ```
fn on_pivots<C: Covariance>(
    posterior: &Posterior<C>,
    old_noise_factor: &Mat<f64>,
    x: MatRef<'_, f64>,
    residuals: &[f64],
    noise_std: f64,
) -> Result<Basis, GpError> {
    let (old, covariance) = (posterior.basis(), posterior.covariance());
    let (r, k) = (old.rank(), x.nrows());
    let mut phi = covariance.cross(old.points.as_ref(), x); // Φ*, (r, k)
    old.factor.half_solve_in_place(phi.as_mut());
    let prior = covariance.gram(x);
    let largest = (0..k).map(|idx| prior[(idx, idx)]).fold(0.0, f64::max);
    let mut remainder = prior; // E, (k, k)
    add_inner_product(&mut remainder, -1.0, phi.as_ref());
    let Choice { order: chosen, l } = independent_rows(remainder.as_ref(), largest);
    let m = chosen.len();
    let mut psi = rows(remainder.as_ref(), &chosen); // Ψ*, (m, k)
    solve_lower_triangular_in_place(l.as_ref(), psi.as_mut(), Par::Seq);

    let old_l = old.factor.l();
    let pivot_factor = Mat::from_fn(r + m, r + m, |row, col| match (row < r, col < r) {
        _ if col > row => 0.0,
        (true, _) => old_l[(row, col)],
        (false, true) => phi[(col, chosen[row - r])],
        (false, false) => l[(row - r, col - r)],
    });
    let part = posterior.noise_std() / noise_std;
    let features = faer::Scale(part) * stacked(phi.as_ref(), psi.as_ref()); // Φ′, (r + m, k)
    let residuals: Vec<f64> = residuals.iter().map(|residual| part * residual).collect();
    let noise_var = posterior.noise_std() * posterior.noise_std();
    let noise_factor = renewed(old_noise_factor, &features, noise_var)?;
    let mut correction = product(features.as_ref(), &residuals);
    let half = ColMut::from_slice_mut(&mut correction);
    noise_factor.solve_in_place(half.as_mat_mut());
    solve_upper_in_place(pivot_factor.transpose(), &mut correction);
    let old_weights = old.weights.iter().copied();
    let weights = old_weights.chain(std::iter::repeat_n(0.0, m));
    Ok(Basis {
        points: stacked(old.points.as_ref(), rows(x, &chosen).as_ref()),
        weights: weights.zip(correction).map(|(a, b)| a + b).collect(),
        factor: Factor::from_lower(pivot_factor),
        noise_factor: Some(upper_of(noise_factor.l())),
    })
}

/// The factor of diag(RᵀR, σ²I) + Φ′Φ′ᵀ.
fn renewed(r: &Mat<f64>, features: &Mat<f64>, noise_var: f64) -> Result<Factor, GpError> {
    let (old, all) = (r.nrows(), features.nrows());
    let mut gram = Mat::from_fn(
        all,
        all,
        |row, col| {
            if row == col { noise_var } else { 0.0 }
        },
    );
    let corner = gram.as_mut().submatrix_mut(0, 0, old, old);
    matmul(corner, Accum::Replace, r.transpose(), r, 1.0, Par::Seq);
    let (f, ft) = (features.as_ref(), features.transpose());
    matmul(gram.as_mut(), Accum::Add, f, ft, 1.0, Par::Seq);
    Ok(Factor::new(gram)?)
}

fn solve_upper_in_place(upper: MatRef<'_, f64>, vector: &mut [f64]) {
    let column = ColMut::from_slice_mut(vector).as_mat_mut();
    solve_upper_triangular_in_place(upper, column, Par::Seq);
}

fn product(matrix: MatRef<'_, f64>, vector: &[f64]) -> Vec<f64> {
    let row = |row: usize| {
        let terms = vector.iter().enumerate();
        terms.map(|(col, value)| matrix[(row, col)] * value).sum()
    };
    (0..matrix.nrows()).map(row).collect()
}

/// The rows of both, one below the other.
fn stacked(top: MatRef<'_, f64>, bottom: MatRef<'_, f64>) -> Mat<f64> {
    let n = top.nrows();
    Mat::from_fn(n + bottom.nrows(), top.ncols(), |row, col| {
        if row < n {
            top[(row, col)]
        } else {
            bottom[(row - n, col)]
        }
    })
}
