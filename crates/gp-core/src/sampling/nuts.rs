//! A chain of draws by the No-U-Turn sampler.

use faer::Mat;
use nuts_rs::rand::Rng;
use nuts_rs::{
    Chain as _, CpuLogpFunc, CpuMath, CpuMathError, DiagNutsSettings, HasDims, LogpError, Settings,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::log_density::LogDensity;
use crate::error::GpError;

/// How long a chain is and how far a trajectory may go.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainOptions {
    /// Draws at the beginning in which step size and metric are adapted; they are dropped.
    pub n_warmup: usize,
    /// Draws that are kept.
    pub n_draws: usize,
    /// A trajectory has fewer than 2^`max_depth` steps.
    pub max_depth: u32,
    /// Mean acceptance probability that the step size is adapted to.
    pub target_acceptance: f64,
}

impl Default for ChainOptions {
    fn default() -> Self {
        Self {
            n_warmup: 500,
            n_draws: 500,
            max_depth: 8,
            target_acceptance: 0.85,
        }
    }
}

/// The draws of one chain, and how it went.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// One draw of z per row, (`n_draws`, d).
    pub draws: Mat<f64>,
    /// Trajectories that left the level of their energy, warm-up apart: where there are many, the
    /// draws miss part of the density.
    pub n_divergences: usize,
    /// Trajectories that were as long as they may be, warm-up apart.
    pub n_longest: usize,
    /// Evaluations of the density, warm-up included.
    pub n_evaluations: usize,
    /// Step size at the end.
    pub step_size: f64,
}

/// Draws from a density, from a given start.
///
/// The metric is diagonal and adapted with the step size while the chain warms up.
/// The draws are a function of the density, the start, the options, `seed` and `chain`; chains of
/// other numbers have other random streams.
/// # Errors
/// [`GpError::NoUsableStart`] if the density has no value at `start`;
/// [`GpError::Sampler`] if the sampler gives up, or the options are not usable.
/// # Panics
/// If `start` does not have d entries.
/// # Source
/// Hoffman & Gelman 2014, "The No-U-Turn sampler"; the crate nuts-rs.
pub fn sample_chain(
    density: &mut impl LogDensity,
    start: &[f64],
    options: &ChainOptions,
    seed: u64,
    chain: u64,
) -> Result<Chain, GpError> {
    let d = density.dimension();
    assert_eq!(start.len(), d);
    if let Err(error) = density.evaluate(start, &mut vec![0.0; d]) {
        return Err(GpError::NoUsableStart {
            n_starts: 1,
            reason: Some(Box::new(error)),
        });
    }
    let mut settings = DiagNutsSettings {
        num_tune: options.n_warmup as u64,
        num_draws: options.n_draws as u64,
        maxdepth: u64::from(options.max_depth),
        ..DiagNutsSettings::default()
    };
    settings.adapt_options.step_size_settings.target_accept = options.target_acceptance;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(chain);

    let gave_up = |error: &dyn std::fmt::Display| GpError::Sampler {
        reason: error.to_string(),
    };
    let math = CpuMath::new(Density(density));
    let mut sampler = (settings.new_chain(chain, math, &mut rng)).map_err(|e| gave_up(&e))?;
    sampler.set_position(start).map_err(|e| gave_up(&e))?;

    let mut result = Chain {
        draws: Mat::zeros(options.n_draws, d),
        n_divergences: 0,
        n_longest: 0,
        n_evaluations: 1,
        step_size: f64::NAN,
    };
    let longest = (1_u64 << options.max_depth) - 1;
    for idx in 0..options.n_warmup + options.n_draws {
        let (draw, progress) = sampler.draw().map_err(|e| gave_up(&e))?;
        result.n_evaluations += usize::try_from(progress.num_gradients).unwrap_or(usize::MAX);
        result.step_size = progress.step_size;
        if idx >= options.n_warmup {
            let row = idx - options.n_warmup;
            for (col, value) in draw.iter().enumerate() {
                result.draws[(row, col)] = *value;
            }
            result.n_divergences += usize::from(progress.diverging);
            result.n_longest += usize::from(progress.num_steps >= longest);
        }
    }
    Ok(result)
}

/// The density in the form that the sampler asks for.
struct Density<'a, D>(&'a mut D);

/// A point without a value: the trajectory ends there.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
struct NoValue(#[from] GpError);

impl LogpError for NoValue {
    fn is_recoverable(&self) -> bool {
        true
    }
}

#[expect(
    clippy::disallowed_types,
    reason = "the sampler's interface; one entry has one order"
)]
impl<D: LogDensity> HasDims for Density<'_, D> {
    fn dim_sizes(&self) -> std::collections::HashMap<String, u64> {
        let name = "unconstrained_parameter".to_string();
        std::collections::HashMap::from([(name, self.0.dimension() as u64)])
    }
}

impl<D: LogDensity> CpuLogpFunc for Density<'_, D> {
    type LogpError = NoValue;
    type FlowParameters = ();
    type ExpandedVector = Vec<f64>;

    fn dim(&self) -> usize {
        self.0.dimension()
    }

    fn logp(&mut self, position: &[f64], gradient: &mut [f64]) -> Result<f64, NoValue> {
        Ok(self.0.evaluate(position, gradient)?)
    }

    fn expand_vector<R: Rng + ?Sized>(
        &mut self,
        _rng: &mut R,
        array: &[f64],
    ) -> Result<Vec<f64>, CpuMathError> {
        Ok(array.to_vec())
    }
}
