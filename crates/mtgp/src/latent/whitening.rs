//! What a posterior of tasks has learned, for functions that its own rows do not name.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, ColMut, Mat, MatRef, Par};
use gp_core::Posterior;
use linalg::{Factor, TriangularRows, add_inner_product, product};

use crate::error::MtgpError;
use crate::prior::{MultiTaskCovariance, split};

/// The covariates of a posterior's points B, (b, d), and their tasks, (b,).
pub(crate) fn points_of(
    posterior: &Posterior<MultiTaskCovariance>,
) -> (MatRef<'_, f64>, Vec<usize>) {
    let rows = posterior.basis().points.as_ref();
    split(rows, posterior.covariance().n_tasks())
}

/// T with cov_D(f, g) = c(f, g) − (T c(B, f))ᵀ (T c(B, g)), lower triangular.
///
/// ```text
/// samples as B:  T = L⁻¹
/// pivots as B:   T = N L⁻¹,   NᵀN = I − σ²R⁻¹R⁻ᵀ,   N lower triangular
/// ```
/// N is the Cholesky factor of its matrix with rows and columns in reverse order, transposed and
/// put back in order. Where rounding has made the matrix indefinite, the identity counts as
/// (1 + b²ε) I: variances then come out smaller by b²ε c(f, f) at most.
/// # Errors
/// [`gp_core::GpError::NotPositiveDefinite`] if a factor is not finite.
pub(crate) fn whitening(
    posterior: &Posterior<MultiTaskCovariance>,
) -> Result<TriangularRows, MtgpError> {
    let basis = posterior.basis();
    let order = basis.rank();
    let mut inverse = Mat::identity(order, order); // L⁻¹
    basis.factor.half_solve_in_place(inverse.as_mut());
    let Some(r) = &basis.noise_factor else {
        return Ok(TriangularRows::lower(inverse.as_ref()));
    };
    let noise_var = posterior.noise_std() * posterior.noise_std();
    let n = remaining(r.as_ref(), noise_var)?;
    Ok(TriangularRows::lower(
        product(n.as_ref(), inverse.as_ref()).as_ref(),
    ))
}

/// N, lower triangular with NᵀN = I − σ²R⁻¹R⁻ᵀ.
fn remaining(r: MatRef<'_, f64>, noise_var: f64) -> Result<Mat<f64>, MtgpError> {
    let order = r.nrows();
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
    Ok(Mat::from_fn(order, order, |row, col| {
        if col <= row {
            l[(last - col, last - row)]
        } else {
            0.0
        }
    }))
}

/// out += aᵀv
pub(crate) fn add_transposed_product(a: MatRef<'_, f64>, v: &[f64], out: &mut [f64]) {
    let v = faer::ColRef::from_slice(v).as_mat();
    let out = ColMut::from_slice_mut(out).as_mat_mut();
    matmul(out, Accum::Add, a.transpose(), v, 1.0, Par::Seq);
}
