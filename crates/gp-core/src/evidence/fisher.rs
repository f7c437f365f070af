//! The Fisher information about the hyperparameters: the metric in which a search takes its steps.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use kernels::Covariance;

use super::likelihood::{layout_with_noise, split_noise};
use super::pivoted::rows;
use super::subsets::spread_rows;
use crate::optimize::Reparametrised;
use linalg::Factor;

/// Samples that the information is computed from, if there are more; it is scaled up for the rest.
const MOST_SAMPLES: usize = 256;

/// Half the step of the differences that give ∂C/∂z.
const STEP: f64 = 1e-4;

/// What is added to the diagonal of the Fisher information: that of a normal prior whose
/// standard deviation is a factor e, or one in coordinates that may have any sign.
const PRIOR_INFORMATION: f64 = 1.0;

/// F + I of [`crate::search::refine`]: a little for what the data do not tell.
///
/// # Panics
/// If it is not square.
pub fn add_prior_information(information: &mut Mat<f64>) {
    for idx in 0..information.ncols() {
        information[(idx, idx)] += PRIOR_INFORMATION;
    }
}

/// The Fisher information F of [`crate::search::refine`] at a point, in its coordinates.
///
/// The point is (θ, σ) with the transforms of the covariance's layout and of
/// [`kernels::Jitter`]'s, which are the logarithms away from the bounds.
/// Comes from at most 256 of the samples; `None` where the covariance matrix is not positive definite.
/// # Shapes
/// `parts` the inputs (n_p, d) of independent parts of the data; `z` (p + 1,) for a covariance of p
/// hyperparameters, whose own values are not used; the result (p + 1, p + 1).
/// # Source
/// Mardia & Marshall 1984, sec. 2.
pub fn information<C: Covariance + Clone>(
    parts: &[MatRef<'_, f64>],
    covariance: &C,
    z: &[f64],
) -> Option<Mat<f64>> {
    let bounds = Reparametrised::new(
        &layout_with_noise(covariance),
        |_: &[f64], _: &mut [f64]| 0.0,
    );
    information_in(parts, covariance, |z| bounds.natural(z), z)
}

/// The same in coordinates of the caller's choice, of which `natural` gives (θ, σ).
pub(crate) fn information_in<C: Covariance + Clone>(
    parts: &[MatRef<'_, f64>],
    covariance: &C,
    natural: impl Fn(&[f64]) -> Vec<f64>,
    z: &[f64],
) -> Option<Mat<f64>> {
    let mut trial = covariance.clone();
    let noisy = |x: MatRef<'_, f64>, z: &[f64]| {
        let theta = natural(z);
        let (of_covariance, noise_std) = split_noise(&theta);
        trial.set_params(of_covariance);
        let mut c = Mat::zeros(x.nrows(), x.nrows());
        trial.add_gram(x, c.as_mut());
        for row in 0..x.nrows() {
            c[(row, row)] += noise_std * noise_std;
        }
        c
    };
    fisher_information(parts, z, noisy)
}

/// The information of independent Gaussian vectors about the coordinates z of their covariance.
///
/// ```text
/// F_ij = ½ Σ_parts tr(C⁻¹ ∂C/∂z_i C⁻¹ ∂C/∂z_j) = ½ Σ ⟨B_i, B_j⟩,   B_i = L⁻¹ ∂C/∂z_i L⁻ᵀ
/// ```
/// ∂C/∂z_i are central differences, with an error of some 10⁻⁸ of them: enough for a metric.
/// Of more than 256 samples in all, every part gives a spread subset in proportion, whose
/// information counts n/k times.
/// `None` where C is not positive definite in double precision, or has no derivative.
/// # Shapes
/// `parts` inputs (n_p, d) of each vector; `covariance(x, z)` writes the lower triangle of
/// C at z; the result is (p, p).
/// # Source
/// Mardia & Marshall 1984, sec. 2; Rasmussen & Williams 2006, eq. (5.9) for ∂log p/∂θ,
/// of which F is the covariance.
fn fisher_information(
    parts: &[MatRef<'_, f64>],
    z: &[f64],
    mut covariance: impl FnMut(MatRef<'_, f64>, &[f64]) -> Mat<f64>,
) -> Option<Mat<f64>> {
    let n_samples: usize = parts.iter().map(MatRef::nrows).sum();
    let mut information = Mat::zeros(z.len(), z.len());
    for x in parts.iter().filter(|x| x.nrows() > 0) {
        let k = samples_of(x.nrows(), n_samples);
        let some = rows(*x, &spread_rows(x.nrows(), k));
        let factor = Factor::new(covariance(some.as_ref(), z)).ok()?;
        let mut b = Mat::zeros(k * (k + 1) / 2, z.len());
        for idx in 0..z.len() {
            let shifted = |shift: f64| {
                let mut z = z.to_vec();
                z[idx] += shift;
                z
            };
            let above = covariance(some.as_ref(), &shifted(STEP));
            let below = covariance(some.as_ref(), &shifted(-STEP));
            whiten(&factor, &above, &below, b.col_as_slice_mut(idx));
        }
        let weight = 0.5 * x.nrows() as f64 / k as f64;
        let product = (b.transpose(), b.as_ref());
        matmul(
            information.as_mut(),
            Accum::Add,
            product.0,
            product.1,
            weight,
            Par::Seq,
        );
    }
    let is_finite = (0..z.len()).all(|col| {
        let column = information.col_as_slice(col);
        column.iter().all(|entry| entry.is_finite())
    });
    is_finite.then_some(information)
}

/// k of a part, in proportion to its samples.
fn samples_of(n_part: usize, n_samples: usize) -> usize {
    if n_samples <= MOST_SAMPLES {
        return n_part;
    }
    (MOST_SAMPLES * n_part).div_ceil(n_samples).min(n_part)
}

/// B of two matrices a double step apart, packed so that ⟨B, B′⟩ is an inner product.
///
/// The lower triangle column by column, entries off the diagonal times √2.
fn whiten(factor: &Factor, above: &Mat<f64>, below: &Mat<f64>, packed: &mut [f64]) {
    let order = factor.order();
    let mut b = Mat::from_fn(order, order, |row, col| {
        let (row, col) = (row.max(col), row.min(col));
        (above[(row, col)] - below[(row, col)]) / (2.0 * STEP)
    });
    factor.half_solve_in_place(b.as_mut());
    let mut b = b.transpose().to_owned();
    factor.half_solve_in_place(b.as_mut());
    let mut entries = packed.iter_mut();
    for col in 0..order {
        for (row, entry) in (col..order).zip(&mut entries) {
            let weight = if row == col {
                1.0
            } else {
                std::f64::consts::SQRT_2
            };
            *entry = weight * b[(row, col)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// C = e^{z₀} S + e^{z₁} I with S_ab = 1/(1 + |a − b|)².
    fn covariance(x: MatRef<'_, f64>, z: &[f64]) -> Mat<f64> {
        Mat::from_fn(x.nrows(), x.nrows(), |a, b| {
            let distance = 1.0 + (x[(a, 0)] - x[(b, 0)]).abs();
            let noise = if a == b { z[1].exp() } else { 0.0 };
            z[0].exp() / (distance * distance) + noise
        })
    }

    fn inputs(n: usize) -> Mat<f64> {
        Mat::from_fn(n, 1, |row, _| row as f64)
    }

    #[test]
    fn information_about_a_variance_is_half_the_number_of_samples() {
        // C = e^{z} I: ½ tr(I) = n/2.
        let x = inputs(7);
        let of = |x: MatRef<'_, f64>, z: &[f64]| {
            Mat::from_fn(
                x.nrows(),
                x.nrows(),
                |a, b| {
                    if a == b { z[0].exp() } else { 0.0 }
                },
            )
        };
        let f = fisher_information(&[x.as_ref()], &[0.3], of).unwrap();
        assert!((f[(0, 0)] - 3.5).abs() < 1e-7, "{}", f[(0, 0)]);
        // 1000 samples count as such, though only 256 are looked at.
        let many = inputs(1000);
        let f = fisher_information(&[many.as_ref()], &[0.3], of).unwrap();
        assert!((f[(0, 0)] - 500.0).abs() < 1e-5, "{}", f[(0, 0)]);
    }

    #[test]
    fn information_is_that_of_the_formula_with_exact_derivatives() {
        let (x, z) = (inputs(6), [0.4, -1.0]);
        let f = fisher_information(&[x.as_ref()], &z, covariance).unwrap();
        let c = covariance(x.as_ref(), &z);
        let inverse = {
            use faer::linalg::solvers::DenseSolveCore;
            c.partial_piv_lu().inverse()
        };
        let noise = Mat::<f64>::identity(6, 6) * faer::Scale(z[1].exp());
        let derivatives = [&c - &noise, noise];
        for (i, d_i) in derivatives.iter().enumerate() {
            for (j, d_j) in derivatives.iter().enumerate() {
                let product = &inverse * d_i * &inverse * d_j;
                let trace: f64 = (0..6).map(|a| product[(a, a)]).sum();
                let difference = (f[(i, j)] - 0.5 * trace).abs();
                assert!(difference < 1e-7 * trace.abs().max(1.0), "{i} {j}");
            }
        }
    }

    #[test]
    fn parts_add_up() {
        let (x, y, z) = (inputs(4), inputs(5), [0.1, 0.2]);
        let one = |part: &Mat<f64>| fisher_information(&[part.as_ref()], &z, covariance).unwrap();
        let both = fisher_information(&[x.as_ref(), y.as_ref()], &z, covariance).unwrap();
        assert!((one(&x) + one(&y) - both).norm_max() < 1e-12);
    }

    #[test]
    fn there_is_none_where_the_covariance_is_not_positive_definite() {
        let x = inputs(3);
        let of = |x: MatRef<'_, f64>, _: &[f64]| Mat::full(x.nrows(), x.nrows(), f64::NAN);
        assert!(fisher_information(&[x.as_ref()], &[0.0], of).is_none());
    }
}
