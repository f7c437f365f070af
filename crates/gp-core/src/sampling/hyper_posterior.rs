//! The posterior of hyperparameters: eq. (8) times a weak proper prior, in unconstrained coordinates.

use std::f64::consts::TAU;

use faer::Mat;
use kernels::{Covariance, Jitter, ParamLayout, Transform};

use super::log_density::LogDensity;
use crate::error::GpError;
use crate::evidence::{Likelihood, information_in};

/// Standard deviation of log θ: a factor of e² either way is one of them.
const LOG_STD: f64 = 2.0;

/// Standard deviation of log(σ² − floor), twice as large for a square.
const LOG_NOISE_VAR_STD: f64 = 4.0;

/// Independent normal priors of the unconstrained coordinates.
///
/// ```text
/// log θ ~ N(log θ₀, 2²)                    standard deviations and length scales
/// logit(u/100) ~ N(logit(u₀/100), 2²)      weights below their ceiling
/// log(σ² − 10⁻⁴) ~ N(log(σ₀² − 10⁻⁴), 4²)  noise
/// Λ_γc ~ N(0, 1)                           entries that may have any sign
/// ```
/// about hyperparameters of the caller's choice, such as those of eq. (22): proper, and wide
/// beside what data of any use say.
/// # Shapes
/// One entry per hyperparameter in θ order, σ last.
#[derive(Debug, Clone, PartialEq)]
pub struct HyperPrior {
    layout: ParamLayout,
    centre: Vec<f64>,
    std: Vec<f64>,
}

impl HyperPrior {
    /// The prior about a covariance's hyperparameters and σ.
    ///
    /// # Errors
    /// [`GpError::Kernel`] for a σ that is not positive.
    pub fn about<C: Covariance>(covariance: &C, noise_std: f64) -> Result<Self, GpError> {
        let layout = (covariance.layout()).followed_by(Jitter::new(noise_std)?.layout());
        let mut theta = covariance.params();
        theta.push(noise_std);
        let (centre, std) = (layout.specs().iter().zip(&theta))
            .map(|(spec, value)| match spec.transform {
                Transform::Free { scale } => (0.0, 1.0 / scale),
                transform @ Transform::SquareAbove { .. } => {
                    let inside = transform.clamp_inside(*value);
                    (transform.unconstrained(inside), LOG_NOISE_VAR_STD)
                }
                transform => {
                    let inside = transform.clamp_inside(*value);
                    (transform.unconstrained(inside), LOG_STD)
                }
            })
            .unzip();
        Ok(Self {
            layout,
            centre,
            std,
        })
    }

    /// Names and transforms, σ last.
    pub fn layout(&self) -> &ParamLayout {
        &self.layout
    }

    /// Natural values (θ, σ) at z.
    ///
    /// # Panics
    /// If `z` does not have one entry per hyperparameter and one for σ.
    pub fn natural(&self, z: &[f64]) -> Vec<f64> {
        assert_eq!(z.len(), self.layout.len());
        let pairs = self.layout.specs().iter().zip(z);
        pairs.map(|(spec, z)| spec.transform.natural(*z)).collect()
    }

    /// The coordinates of (θ, σ), at most two standard deviations of the prior from its centre.
    ///
    /// A chain that sets out from a maximum of the likelihood, where hyperparameters may have run
    /// off to zero, would else have to come all the way back.
    /// # Panics
    /// If `theta` does not have one entry per hyperparameter and one for σ.
    pub fn start(&self, theta: &[f64]) -> Vec<f64> {
        assert_eq!(theta.len(), self.layout.len());
        let near = |idx: usize| {
            let (centre, std) = (self.centre[idx], self.std[idx]);
            let z = self.layout.specs()[idx].transform.unconstrained(theta[idx]);
            let z = if z.is_nan() { centre } else { z };
            z.clamp(centre - 2.0 * std, centre + 2.0 * std)
        };
        (0..theta.len()).map(near).collect()
    }

    /// Natural logarithm of the prior density of z, and its gradient added.
    fn add(&self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let mut value = 0.0;
        for (idx, slope) in gradient.iter_mut().enumerate() {
            if self.std[idx].is_finite() {
                let deviation = (z[idx] - self.centre[idx]) / self.std[idx];
                value -= 0.5 * (deviation * deviation + TAU.ln()) + self.std[idx].ln();
                *slope -= deviation / self.std[idx];
            }
        }
        value
    }
}

/// p(z | X, t), up to its normalisation, for any likelihood of (θ, σ).
#[derive(Debug, Clone)]
pub struct HyperPosterior<C, L> {
    covariance: C,
    likelihood: L,
    prior: HyperPrior,
}

impl<C: Covariance, L: Likelihood<C>> HyperPosterior<C, L> {
    /// The posterior; `covariance` says which hyperparameters there are, its values do not matter.
    ///
    /// # Panics
    /// If the prior is that of another covariance.
    pub fn new(covariance: C, likelihood: L, prior: HyperPrior) -> Self {
        assert_eq!(covariance.n_params() + 1, prior.layout.len());
        Self {
            covariance,
            likelihood,
            prior,
        }
    }

    /// The prior.
    pub fn prior(&self) -> &HyperPrior {
        &self.prior
    }
}

impl<C: Covariance + Clone, L: Likelihood<C>> HyperPosterior<C, L> {
    /// What data and prior say of z: the Fisher information and the prior's precision, (d, d).
    ///
    /// ```text
    /// ½ tr(C⁻¹ ∂C/∂z_i C⁻¹ ∂C/∂z_j) + δ_ij/s_i²,   C = K + σ²I
    /// ```
    /// Lower triangle; `None` where C is not positive definite in double precision.
    /// # Panics
    /// If `z` does not have one entry per hyperparameter and one for σ.
    /// # Source
    /// Rasmussen & Williams 2006, eq. (5.9), of whose gradient it is the covariance.
    pub fn information(&self, z: &[f64]) -> Option<Mat<f64>> {
        let natural = |z: &[f64]| self.prior.natural(z);
        let parts = self.likelihood.parts();
        let mut information = information_in(&parts, &self.covariance, natural, z)?;
        for (idx, std) in self.prior.std.iter().enumerate() {
            information[(idx, idx)] += (std * std).recip();
        }
        Some(information)
    }
}

impl<C: Covariance, L: Likelihood<C>> LogDensity for HyperPosterior<C, L> {
    fn dimension(&self) -> usize {
        self.prior.layout.len()
    }

    fn evaluate(&mut self, z: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        let theta = self.prior.natural(z);
        let (noise_std, of_covariance) = theta.split_last().expect("σ is the last");
        self.covariance.set_params(of_covariance);
        gradient.fill(0.0);
        let evaluation = (self.likelihood).evaluate(&self.covariance, *noise_std, gradient)?;
        let specs = self.prior.layout.specs().iter();
        for ((slope, spec), z) in gradient.iter_mut().zip(specs).zip(z) {
            *slope *= spec.transform.derivative(*z);
        }
        let value = evaluation.log_marginal_likelihood + self.prior.add(z, gradient);
        if value.is_finite() && gradient.iter().all(|slope| slope.is_finite()) {
            return Ok(value);
        }
        Err(GpError::NonFiniteLikelihood {
            n_samples: self.likelihood.n_samples(),
        })
    }
}
