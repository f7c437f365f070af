//! Chains of hyperparameters of a multi-task process.

use faer::Mat;
use gp_core::fit::chapter_start;
use gp_core::sampling::{
    Chain, ChainOptions, ChainSummary, HyperPosterior, HyperPrior, Laplace, LogDensity,
    sample_chains,
};
use gp_core::{LikelihoodOptions, LogMarginal, Posterior};
use kernels::{ContinuousJoints, Covariance, TorqueForm};
use mtgp::prior::{TaskMatrix, TaskRegression};
use mtgp::{MultiTaskCovariance, Stacked};
use serde::{Deserialize, Serialize};
use torque_model::{TaskProcess, TorqueFunction};

use super::settings::Settings;
use crate::error::BenchError;

/// The prior with K^ρ in the coordinates that chains move in.
pub type Regressions = MultiTaskCovariance<TaskRegression>;

/// Seed of the chains; a joint and a chain number make a stream of it.
const SEED: u64 = 2008;

/// The chains of one joint and what they say of themselves.
pub struct Drawn {
    chains: Vec<Chain>,
    prior: HyperPrior,
    covariance: Regressions,
    /// How far they can be trusted.
    pub diagnostics: Diagnostics,
}

/// How well the chains of a joint agree, and what they took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Diagnostics {
    /// What the likelihood knows: log density, σ and the prior variance of the squared exponential.
    pub known: Agreement,
    /// Correlations between loads.
    pub correlations: Agreement,
    /// Every coordinate: logarithms of θ^x, σ and the new parts s of the regressions, and their coefficients.
    pub coordinates: Agreement,
    /// Over all chains.
    pub n_divergences: usize,
    /// Likelihoods with gradient of all chains.
    pub n_evaluations: usize,
}

/// Draws from the posterior of the hyperparameters of a point estimate's process.
///
/// K^ρ is drawn as regressions of the loads on one another, in the order that the point estimate's
/// K^ρ gives them: see [`mtgp::prior::TaskRegression`].
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
    let covariance = point.covariance().with_regression()?;
    let prior = prior(data, targets, &covariance)?;
    let mut theta = covariance.params();
    theta.push(point.noise_var().sqrt());
    let start = prior.start(&theta);
    let options = ChainOptions {
        n_warmup: settings.n_warmup,
        n_draws: settings.n_draws,
        max_depth: settings.max_depth,
        target_acceptance: settings.target_acceptance,
    };
    let posterior = || {
        let likelihood = LogMarginal::new(data.inputs(), targets, LikelihoodOptions::dense());
        HyperPosterior::new(covariance.clone(), likelihood, prior.clone())
    };
    let seed = SEED + joint as u64;
    let laplace = Laplace::climb(&mut posterior(), &start)?;
    let chains = sample_chains(posterior, &laplace, &options, settings.n_chains, seed)?;
    let [known, correlations, coordinates] = agreements(&chains, &mut posterior(), &covariance);
    Ok(Drawn {
        diagnostics: Diagnostics {
            known,
            correlations,
            coordinates,
            n_divergences: chains.iter().map(|chain| chain.n_divergences).sum(),
            n_evaluations: chains.iter().map(|chain| chain.n_evaluations).sum(),
        },
        chains,
        prior,
        covariance,
    })
}

/// Weak priors about eq. (22) on the pooled data, which c^x of the first load resembles; K^ρ about I.
fn prior(
    data: &Stacked,
    targets: &[f64],
    covariance: &Regressions,
) -> Result<HyperPrior, BenchError> {
    let moments = chapter_start(
        data.covariates(),
        targets,
        TorqueForm::Coulomb,
        &ContinuousJoints::none(),
    )?;
    let mut task = covariance.task().clone();
    task.set_params(&vec![1.0; task.n_params()]);
    let centre = MultiTaskCovariance::new(moments.covariance, task);
    Ok(HyperPrior::about(&centre, moments.noise_std)?)
}

/// How well chains agree about some quantities.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// The largest R̂ of them.
    pub r_hat: f64,
    /// The quantity that has it.
    pub worst: String,
    /// The smallest effective sample size of them.
    pub size: f64,
}

impl Agreement {
    /// Of named quantities, each with its values in the draws of every chain.
    fn of(quantities: impl IntoIterator<Item = (String, Vec<Vec<f64>>)>) -> Self {
        let mut agreement = Self {
            r_hat: 1.0,
            worst: String::new(),
            size: f64::INFINITY,
        };
        for (name, chains) in quantities {
            let summary = ChainSummary::of(&chains);
            agreement.size = agreement.size.min(summary.bulk_size);
            if summary.r_hat > agreement.r_hat || agreement.worst.is_empty() {
                (agreement.r_hat, agreement.worst) = (summary.r_hat, name);
            }
        }
        agreement
    }
}

/// The values of all quantities at one draw, in the three groups of [`Diagnostics`].
fn quantities(
    z: &[f64],
    posterior: &mut HyperPosterior<Regressions, LogMarginal<'_>>,
    covariance: &mut Regressions,
) -> [Vec<f64>; 3] {
    let mut gradient = vec![0.0; z.len()];
    let log_density = posterior.evaluate(z, &mut gradient);
    let theta = posterior.prior().natural(z);
    let (noise_std, of_covariance) = theta.split_last().expect("σ is the last");
    covariance.set_params(of_covariance);
    let variances = covariance.task().k_task();
    let trace: f64 = (0..variances.nrows()).map(|i| variances[(i, i)]).sum();
    let signal_std = covariance.input().se().signal_std();
    let known = vec![
        log_density.unwrap_or(f64::NEG_INFINITY),
        noise_std.ln(),
        (signal_std * signal_std * trace).ln(),
    ];

    let correlations = covariance.task().correlations();
    let below = (1..correlations.nrows()).flat_map(|row| (0..row).map(move |col| (row, col)));
    let correlations = below.map(|place| correlations[place]).collect();

    [known, correlations, z.to_vec()]
}

/// Of the log density, log σ and log(v² tr K^ρ); of correlations; of coordinates.
fn agreements(
    chains: &[Chain],
    posterior: &mut HyperPosterior<Regressions, LogMarginal<'_>>,
    covariance: &Regressions,
) -> [Agreement; 3] {
    let mut covariance = covariance.clone();
    let draws: Vec<Vec<[Vec<f64>; 3]>> = (chains.iter())
        .map(|chain| {
            (0..chain.draws.nrows())
                .map(|row| quantities(&row_of(&chain.draws, row), posterior, &mut covariance))
                .collect()
        })
        .collect();
    let m = covariance.n_tasks();
    let pairs =
        (1..m).flat_map(|row| (0..row).map(move |col| format!("c{}, c{}", row + 1, col + 1)));
    let specs = posterior.prior().layout().specs().iter();
    let names = [
        ["log density", "σ", "signal variance"]
            .map(String::from)
            .to_vec(),
        pairs.collect(),
        specs.map(ToString::to_string).collect(),
    ];
    let mut groups = names.into_iter().enumerate().map(|(group, names)| {
        Agreement::of(names.into_iter().enumerate().map(|(idx, name)| {
            let of_chain =
                |draws: &Vec<[Vec<f64>; 3]>| draws.iter().map(|d| d[group][idx]).collect();
            (name, draws.iter().map(of_chain).collect())
        }))
    });
    std::array::from_fn(|_| groups.next().expect("three groups"))
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
    ) -> Result<Vec<Posterior<Regressions>>, BenchError> {
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
                posteriors.push(Posterior::new(covariance, *noise_std, x, targets, dense)?);
            }
        }
        Ok(posteriors)
    }
}

/// A row of a matrix.
pub(super) fn row_of(matrix: &Mat<f64>, row: usize) -> Vec<f64> {
    matrix.row(row).iter().copied().collect()
}
