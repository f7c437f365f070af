//! Chains of hyperparameters of a multi-task process.

use gp_core::sampling::{
    Chain, ChainOptions, ChainSummary, HyperPosterior, HyperPrior, LogDensity,
};
use gp_core::{FitPosterior, LikelihoodOptions, LogMarginal, chapter_start};
use kernels::{Covariance, TorqueForm};
use mtgp::{MultiTaskCovariance, Stacked, TaskProcess};
use rayon::prelude::*;

use super::{Settings, row_of};
use crate::error::BenchError;

/// Seed of the chains; a joint and a chain number make a stream of it.
const SEED: u64 = 2008;

/// The chains of one joint and what they say of themselves.
pub struct Drawn {
    chains: Vec<Chain>,
    prior: HyperPrior,
    covariance: MultiTaskCovariance,
    /// The largest R̂ of the quantities compared.
    pub r_hat: f64,
    /// The smallest effective sample size of them.
    pub size: f64,
    /// Over all chains.
    pub n_divergences: usize,
    /// Likelihoods with gradient of all chains.
    pub n_evaluations: usize,
}

/// Draws from the posterior of the hyperparameters of a point estimate's process.
///
/// # Errors
/// `Fit` if a chain cannot begin or go on.
pub fn draw(
    data: &Stacked,
    targets: &[f64],
    point: &TaskProcess,
    settings: &Settings,
    joint: usize,
) -> Result<Drawn, BenchError> {
    let covariance = point.covariance().clone();
    let prior = prior(data, targets, &covariance)?;
    let mut theta = covariance.params();
    theta.push(point.noise_var().sqrt());
    let start = prior.start(&theta);
    let options = ChainOptions {
        n_warmup: settings.n_warmup,
        n_draws: settings.n_draws,
        max_depth: settings.max_depth,
        ..ChainOptions::default()
    };
    let posterior = || {
        let likelihood = LogMarginal::new(data.inputs(), targets, LikelihoodOptions::dense());
        HyperPosterior::new(covariance.clone(), likelihood, prior.clone())
    };
    let seed = SEED + joint as u64;
    let chains: Vec<Chain> = (0..settings.n_chains)
        .into_par_iter()
        .map(|k| gp_core::sampling::sample_chain(&mut posterior(), &start, &options, seed, k))
        .collect::<Result<_, _>>()?;
    let summaries = summaries(&chains, &mut posterior());
    Ok(Drawn {
        r_hat: summaries.iter().map(|s| s.r_hat).fold(0.0, f64::max),
        size: summaries
            .iter()
            .map(|s| s.bulk_size)
            .fold(f64::INFINITY, f64::min),
        n_divergences: chains.iter().map(|chain| chain.n_divergences).sum(),
        n_evaluations: chains.iter().map(|chain| chain.n_evaluations).sum(),
        chains,
        prior,
        covariance,
    })
}

/// Weak priors about eq. (22) on the pooled data.
fn prior(
    data: &Stacked,
    targets: &[f64],
    covariance: &MultiTaskCovariance,
) -> Result<HyperPrior, BenchError> {
    let moments = chapter_start(data.covariates(), targets, TorqueForm::Coulomb)?;
    let centre = MultiTaskCovariance::new(moments.covariance, covariance.task().clone());
    Ok(HyperPrior::about(&centre, moments.noise_std)?)
}

/// Of the log density, log σ and log(v² tr K^ρ).
fn summaries(
    chains: &[Chain],
    posterior: &mut HyperPosterior<MultiTaskCovariance, LogMarginal<'_>>,
) -> [ChainSummary; 3] {
    let mut quantities = [const { Vec::new() }; 3];
    let mut gradient = vec![0.0; posterior.dimension()];
    for chain in chains {
        let mut of_chain = [const { Vec::new() }; 3];
        for idx in 0..chain.draws.nrows() {
            let z = row_of(&chain.draws, idx);
            let log_density = posterior.evaluate(&z, &mut gradient);
            of_chain[0].push(log_density.unwrap_or(f64::NEG_INFINITY));
            let theta = posterior.prior().natural(&z);
            let of_name = |name: &str| {
                let range = posterior.prior().layout().range(name);
                range.map_or(&[][..], |range| &theta[range])
            };
            let squares = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
            of_chain[1].push(squares(of_name("noise_std")).ln());
            let task = squares(of_name("task_factor"));
            of_chain[2].push((squares(of_name("signal_std")) * task).ln());
        }
        for (all, of_chain) in quantities.iter_mut().zip(of_chain) {
            all.push(of_chain);
        }
    }
    quantities.map(|quantity| ChainSummary::of(&quantity))
}

impl Drawn {
    /// The processes of `count` draws of every chain, at even distances, conditioned on the data.
    ///
    /// # Errors
    /// `Fit`.
    pub fn posteriors(
        &self,
        data: &Stacked,
        targets: &[f64],
        count: usize,
    ) -> Result<Vec<FitPosterior<MultiTaskCovariance>>, BenchError> {
        let mut posteriors = Vec::new();
        for chain in &self.chains {
            let n = chain.draws.nrows();
            for idx in 0..count.min(n) {
                let z = row_of(&chain.draws, (idx + 1) * n / count.min(n) - 1);
                let theta = self.prior.natural(&z);
                let (noise_std, of_covariance) = theta.split_last().expect("σ is the last");
                let mut covariance = self.covariance.clone();
                covariance.set_params(of_covariance);
                let dense = LikelihoodOptions::dense();
                let x = data.inputs();
                posteriors.push(FitPosterior::new(
                    covariance, *noise_std, x, targets, dense,
                )?);
            }
        }
        Ok(posteriors)
    }
}
