//! The Fisher information in the coordinates of a search.

use faer::{Mat, MatRef};
use kernels::Covariance;

use crate::fisher::fisher_information;
use crate::optimize::Reparametrised;
use crate::search::{search_layout, split_noise};

/// What is added to the diagonal of the Fisher information: that of a normal prior whose
/// standard deviation is a factor e, or one in coordinates that may have any sign.
const PRIOR_INFORMATION: f64 = 1.0;

/// F + I of [`crate::refine`]: a little for what the data do not tell.
///
/// # Panics
/// If it is not square.
pub fn add_prior_information(information: &mut Mat<f64>) {
    for idx in 0..information.ncols() {
        information[(idx, idx)] += PRIOR_INFORMATION;
    }
}

/// The Fisher information F of [`crate::refine`] at a point, in its coordinates.
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
    let bounds = Reparametrised::new(&search_layout(covariance), |_: &[f64], _: &mut [f64]| 0.0);
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
