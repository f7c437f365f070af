//! What a search climbs and a sampler draws from: a likelihood of (θ, σ), which answers for its data.

use faer::MatRef;
use kernels::{Covariance, Jitter, ParamLayout};

use super::options::{Evaluation, MethodUsed};
use crate::error::GpError;

/// Eq. (8) of some covariance on some data.
///
/// [`crate::LogMarginal`] is one; a sum of it over independent parts of the data is another.
pub trait Likelihood<C> {
    /// The value and its gradient with respect to (θ, σ).
    ///
    /// # Errors
    /// Where there is no value; a search backs away from there.
    /// # Panics
    /// If `gradient` does not have one entry per hyperparameter and one for σ.
    fn evaluate(
        &mut self,
        covariance: &C,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError>;

    /// The inputs of each part of the data, (n_p, d); parts are independent given (θ, σ).
    fn parts(&self) -> Vec<MatRef<'_, f64>>;

    /// n, in all parts of the data together.
    fn n_samples(&self) -> usize {
        self.parts().iter().map(MatRef::nrows).sum()
    }

    /// Roughly the error that rounding K leaves in the value, in nats.
    ///
    /// ```text
    /// |Σ_ab Q_ab δK_ab| ≲ n ε max_a K_aa / σ²,   as |δK_ab| ≤ ε max K and ‖K⁻¹‖ ≤ 1/σ²
    /// ```
    fn rounding(&self, covariance: &C, noise_std: f64) -> f64
    where
        C: Covariance,
    {
        let parts = self.parts();
        let n_samples: usize = parts.iter().map(MatRef::nrows).sum();
        let variances = parts.into_iter().flat_map(|x| covariance.diag(x));
        let largest = variances.fold(0.0, f64::max);
        n_samples as f64 * f64::EPSILON * largest / (noise_std * noise_std)
    }

    /// Work of one evaluation, in evaluations by the dense path: roughly, and never by the clock.
    ///
    /// ```text
    /// 1                       dense, n³ floating-point operations for factor and inverse
    /// 10 r²/n² + 300 r/n²     low-rank: 10 n r² for pivots, orthogonal factor and adjoints,
    ///                         300 n r for entries of the covariance and their gradient
    /// ```
    fn work(&self, outcome: &Result<Evaluation, GpError>) -> f64 {
        match outcome {
            Ok(evaluation) if evaluation.method == MethodUsed::Certified => {
                let (n, rank) = (self.n_samples() as f64, evaluation.rank as f64);
                (10.0 * rank * rank + 300.0 * rank) / (n * n)
            }
            _ => 1.0,
        }
    }
}

/// Layout of (θ, σ).
pub(crate) fn layout_with_noise<C: Covariance>(covariance: &C) -> ParamLayout {
    let noise = Jitter::new(1.0).expect("one is positive");
    covariance.layout().followed_by(noise.layout())
}

/// (θ, σ).
pub(crate) fn with_noise<C: Covariance>(covariance: &C, noise_std: f64) -> Vec<f64> {
    let mut theta = covariance.params();
    theta.push(noise_std);
    theta
}

/// θ and σ.
///
/// # Panics
/// If there is no σ.
pub(crate) fn split_noise(theta: &[f64]) -> (&[f64], f64) {
    let (noise_std, of_covariance) = theta.split_last().expect("σ is the last hyperparameter");
    (of_covariance, *noise_std)
}
