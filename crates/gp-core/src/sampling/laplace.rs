//! The normal density at a posterior's maximum: where chains set out from, and their coordinates.

use faer::Mat;
use kernels::Covariance;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::hyper_posterior::HyperPosterior;
use super::log_density::LogDensity;
use super::normal::normal_quantile;
use super::nuts::{Chain, ChainOptions, sample_chain};
use crate::error::GpError;
use crate::optimize::{Metric, MinimizeOptions, Objective, Scaled, minimize};
use crate::search::Likelihood;

/// Times that the climb renews its metric.
const ROUNDS: usize = 4;

/// Each round of the climb, which need not end at the maximum to the last digit.
const CLIMB: MinimizeOptions = MinimizeOptions {
    gradient_tolerance: 1e-2,
    value_tolerance: 1e-6,
    max_evaluations: 80,
    max_recoveries: 2,
};

/// Times that a start without a density is drawn nearer to the maximum by half.
const RETREATS: usize = 20;

/// A posterior's maximum and the information there.
///
/// ```text
/// p(z | X, t) ≈ N(z; ẑ, G⁻¹),   G = F(ẑ) + diag(1/s²),   z = ẑ + L⁻ᵀ y,   G = LLᵀ
/// ```
/// In the coordinates y, all directions have about the scale of their standard deviation, and a
/// chain takes a few long steps where it would take many short ones in z.
/// The draws are those of the posterior whatever G is; it only sets their price.
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

    /// ẑ.
    pub fn mode(&self) -> &[f64] {
        &self.mode
    }

    /// log p(ẑ | X, t), up to its normalisation.
    pub fn log_density(&self) -> f64 {
        self.log_density
    }

    /// z of y.
    pub fn outer(&self, y: &[f64]) -> Vec<f64> {
        let step = self.metric.step(y);
        self.mode.iter().zip(step).map(|(z, s)| z + s).collect()
    }

    /// A chain in the coordinates y, from a start of its own; its draws are of z.
    ///
    /// The start is a draw of N(ẑ, spread² G⁻¹), half as far away as often as it takes for the
    /// density to have a value there.
    /// # Errors
    /// As for [`sample_chain`].
    /// # Panics
    /// If the density is of another dimension.
    pub fn sample_chain(
        &self,
        density: &mut impl LogDensity,
        spread: f64,
        options: &ChainOptions,
        seed: u64,
        chain: u64,
    ) -> Result<Chain, GpError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ START_STREAM);
        rng.set_stream(chain);
        let mut y: Vec<f64> = (0..self.mode.len())
            .map(|_| spread * normal(&mut rng))
            .collect();
        let mut whitened = Whitened {
            density,
            laplace: self,
        };
        let mut gradient = vec![0.0; y.len()];
        for _ in 0..RETREATS {
            if whitened.evaluate(&y, &mut gradient).is_ok() {
                break;
            }
            for y in &mut y {
                *y *= 0.5;
            }
        }
        let mut chain = sample_chain(&mut whitened, &y, options, seed, chain)?;
        for row in 0..chain.draws.nrows() {
            let y: Vec<f64> = chain.draws.row(row).iter().copied().collect();
            for (col, z) in self.outer(&y).into_iter().enumerate() {
                chain.draws[(row, col)] = z;
            }
        }
        Ok(chain)
    }
}

/// Keeps the streams of starts apart from those of chains.
const START_STREAM: u64 = 0x5354_4152_5453;

/// A standard normal number.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // 53 bits in the middles of their intervals: never 0 or 1.
    let uniform = ((rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    normal_quantile(uniform)
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

/// A density in the coordinates y.
struct Whitened<'a, D> {
    density: &'a mut D,
    laplace: &'a Laplace,
}

impl<D: LogDensity> LogDensity for Whitened<'_, D> {
    fn dimension(&self) -> usize {
        self.laplace.mode.len()
    }

    fn evaluate(&mut self, y: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        let value = (self.density).evaluate(&self.laplace.outer(y), gradient)?;
        self.laplace.metric.pull_back(gradient);
        Ok(value)
    }
}
