//! The normal density at a posterior's maximum: where chains set out from, and their coordinates.

use faer::{Mat, MatRef};
use kernels::Covariance;

use super::frame::Frame;
use super::hyper_posterior::HyperPosterior;
use super::log_density::LogDensity;
use crate::error::GpError;
use crate::evidence::Likelihood;
use crate::optimize::{Metric, MinimizeOptions, Objective, Scaled, minimize};

/// Times that the climb renews its metric.
const ROUNDS: usize = 4;

/// Each round of the climb, which need not end at the maximum to the last digit.
const CLIMB: MinimizeOptions = MinimizeOptions {
    gradient_tolerance: 1e-2,
    value_tolerance: 1e-6,
    max_evaluations: 80,
    max_recoveries: 2,
};

/// A posterior's maximum and the information there.
///
/// ```text
/// p(z | X, t) ≈ N(z; ẑ, G⁻¹),   G = F(ẑ) + diag(1/s²),   z = ẑ + L⁻ᵀ y,   G = LLᵀ
/// ```
/// In the coordinates y, all directions have about the scale of their standard deviation at the maximum:
/// what [`crate::sampling::sample_chains`] begins with.
/// # Source
/// Rasmussen & Williams 2006, sec. 5.5.1; Girolami & Calderhead 2011 for F as a metric of chains.
pub struct Laplace {
    mode: Vec<f64>,
    log_density: f64,
    metric: Metric,
}

impl Laplace {
    /// Climbs from a start, in the metric of the information on the way.
    ///
    /// # Errors
    /// [`GpError::NoUsableStart`] if the posterior has no value at `start`, or no information
    /// where the climb ends.
    /// # Panics
    /// If `start` does not have one entry per hyperparameter and one for σ.
    pub fn climb<C: Covariance + Clone, L: Likelihood<C>>(
        posterior: &mut HyperPosterior<C, L>,
        start: &[f64],
    ) -> Result<Self, GpError> {
        let mut mode = start.to_vec();
        let mut log_density = f64::NEG_INFINITY;
        for _ in 0..ROUNDS {
            let metric = metric(posterior, &mode)?;
            let mut objective = Scaled::new(Negative(posterior), mode.clone(), Some(metric));
            let minimum = minimize(&mut objective, &vec![0.0; mode.len()], &CLIMB);
            if !minimum.value.is_finite() {
                return Err(GpError::NoUsableStart {
                    n_starts: 1,
                    reason: None,
                });
            }
            mode = objective.outer(&minimum.z);
            let gained = -minimum.value - log_density;
            log_density = -minimum.value;
            if gained < CLIMB.gradient_tolerance {
                break;
            }
        }
        Ok(Self {
            metric: metric(posterior, &mode)?,
            log_density,
            mode,
        })
    }

    /// The normal density of a given centre and information, of whose height nothing is known.
    ///
    /// `None` unless the information is positive definite.
    /// # Shapes
    /// `information` (d, d), of which the lower triangle is read.
    pub fn about(centre: Vec<f64>, information: MatRef<'_, f64>) -> Option<Self> {
        Some(Self {
            metric: Metric::new(information)?,
            log_density: f64::NAN,
            mode: centre,
        })
    }

    /// ẑ.
    pub fn mode(&self) -> &[f64] {
        &self.mode
    }

    /// log p(ẑ | X, t), up to its normalisation.
    pub fn log_density(&self) -> f64 {
        self.log_density
    }

    /// The coordinates y.
    pub(crate) fn frame(&self) -> Frame {
        Frame::new(self.mode.clone(), |y| self.metric.step(y))
    }
}

fn metric<C: Covariance + Clone, L: Likelihood<C>>(
    posterior: &HyperPosterior<C, L>,
    z: &[f64],
) -> Result<Metric, GpError> {
    let information: Option<Mat<f64>> = posterior.information(z);
    information
        .and_then(|information| Metric::new(information.as_ref()))
        .ok_or(GpError::NoUsableStart {
            n_starts: 1,
            reason: None,
        })
}

/// −log p for a search.
struct Negative<'a, D>(&'a mut D);

impl<D: LogDensity> Objective for Negative<'_, D> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let Ok(value) = self.0.evaluate(z, gradient) else {
            return f64::INFINITY;
        };
        for slope in gradient {
            *slope = -*slope;
        }
        -value
    }
}
