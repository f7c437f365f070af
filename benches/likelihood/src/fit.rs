//! Hyperparameters at a maximum of the likelihood, where a fit spends its evaluations.

use std::path::Path;

use anyhow::{Context, Result};
use clap::ValueEnum;
use gp_core::optimize::{MinimizeOptions, Objective, minimize};
use gp_core::{FitOptions, LikelihoodOptions, LogMarginal};
use gp_core::evidence::evidence;
use gp_core::fit::{chapter_start, varied_start};
use gp_core::search::Origin;
use kernels::{Covariance, Jitter, ParamLayout, TorqueForm};

use mtgp::{MultiTaskOptions, StageOne};

use crate::data::Samples;
use crate::hyperparameters::{Hyperparameters, SmoothPart};

/// What the hyperparameters are of.
#[derive(Clone, Copy, ValueEnum)]
pub enum Model {
    /// GPc, eq. (7): bias, linear, squared exponential and Coulomb friction
    Full,
    /// Bias and squared exponential, which every contestant can express
    Smooth,
    /// Eq. (16) with rank 4: the full model for several loads at once
    Loads,
}

/// Rank of the covariance between loads.
const RANK: usize = 4;


/// A length scale or weight that the data do not determine runs off to 10⁹ or 10⁻⁹; both ends
/// are inside what every contestant accepts, and far from making a difference.
const RANGE: (f64, f64) = (1e-6, 1e4);

/// Fits, clips and writes.
pub fn write(samples: &Samples, model: Model, output: &Path) -> Result<()> {
    let fitted = match model {
        Model::Full => full(samples)?,
        Model::Smooth => smooth(samples)?,
        Model::Loads => of_loads(samples)?,
    };
    let clipped = fitted.clipped(RANGE.0, RANGE.1);
    println!("fitted  {:?}: {}", fitted, value(samples, &fitted)?);
    println!("clipped {:?}: {}", clipped, value(samples, &clipped)?);
    let name = match model {
        Model::Full => "full",
        Model::Smooth => "smooth",
        Model::Loads => "loads",
    };
    let text = format!(
        "# Made by: likelihood fit --n {} --model {name}; moved into [{:e}, {:e}].\n{}",
        samples.targets.len(),
        RANGE.0,
        RANGE.1,
        toml::to_string(&clipped)?
    );
    std::fs::write(output, text).with_context(|| format!("writing {}", output.display()))
}

fn full(samples: &Samples) -> Result<Hyperparameters> {
    let fit = gp_core::fit(
        samples.x.as_ref(),
        &samples.targets,
        TorqueForm::Coulomb,
        &FitOptions::several(),
    )?;
    Ok(Hyperparameters::full(fit.covariance(), fit.noise_std()))
}

/// mGP of rank 4, searched as figures 10 and 11 do it.
fn of_loads(samples: &Samples) -> Result<Hyperparameters> {
    let (data, targets) = samples.stacked()?;
    let options = MultiTaskOptions::several();
    let stage_one = StageOne::new(&data, &targets, &options)?;
    let fits = mtgp::fit_ranks(&data, &targets, &[RANK], &stage_one, &options)?;
    let fit = fits.first().context("no fit")?;
    println!("{:?}", fit.report);
    Hyperparameters::of_loads(fit.covariance(), fit.noise_std())
}

fn smooth(samples: &Samples) -> Result<Hyperparameters> {
    let x = samples.x.as_ref();
    let chapter = chapter_start(x, &samples.targets, TorqueForm::Smooth)?;
    let start = varied_start(&chapter, Origin::TypicalPairs)?;
    let start = Hyperparameters::smooth_part_of(&start);
    let covariance = start.smooth_part()?;
    let mut theta = covariance.params();
    theta.push(start.noise_std);
    let mut search = Search {
        layout: covariance.layout().followed_by(Jitter::new(1.0)?.layout()),
        likelihood: LogMarginal::new(x, &samples.targets, LikelihoodOptions::automatic()),
        covariance,
    };
    let z = (search.layout.specs().iter().zip(&theta))
        .map(|(spec, &theta)| spec.transform.unconstrained(theta))
        .collect::<Vec<_>>();
    let options = MinimizeOptions {
        gradient_tolerance: 1e-3,
        value_tolerance: 1e-5,
        max_evaluations: 300,
        max_recoveries: 10,
    };
    let minimum = minimize(&mut search, &z, &options);
    Ok(of_smooth_part(
        &search.natural(&minimum.z),
        &search.covariance,
    ))
}

/// The negative likelihood over unconstrained coordinates.
struct Search<'a> {
    layout: ParamLayout,
    likelihood: LogMarginal<'a>,
    covariance: SmoothPart,
}

impl Search<'_> {
    fn natural(&self, z: &[f64]) -> Vec<f64> {
        let pairs = self.layout.specs().iter().zip(z);
        pairs.map(|(spec, &z)| spec.transform.natural(z)).collect()
    }
}

impl Objective for Search<'_> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let theta = self.natural(z);
        let n_params = theta.len() - 1;
        self.covariance.set_params(&theta[..n_params]);
        let outcome = (self.likelihood).evaluate(&self.covariance, theta[n_params], gradient);
        for ((g, spec), &z) in gradient.iter_mut().zip(self.layout.specs()).zip(z) {
            *g *= -spec.transform.derivative(z);
        }
        outcome.map_or(f64::INFINITY, |found| -found.log_marginal_likelihood)
    }
}

/// (θ, σ) of bias + squared exponential by name.
fn of_smooth_part(theta: &[f64], covariance: &SmoothPart) -> Hyperparameters {
    let n_params = covariance.n_params();
    let mut covariance = covariance.clone();
    covariance.set_params(&theta[..n_params]);
    Hyperparameters {
        bias_std: covariance.first().bias_std(),
        signal_std: covariance.second().signal_std(),
        noise_std: theta[n_params],
        length_scales: covariance.second().length_scales().to_vec(),
        linear_std: Vec::new(),
        coulomb_std: Vec::new(),
        task_factor: Vec::new(),
    }
}

fn value(samples: &Samples, at: &Hyperparameters) -> Result<f64> {
    let (x, targets, options) = (
        samples.x.as_ref(),
        &samples.targets,
        LikelihoodOptions::dense(),
    );
    let evidence = if at.has_several_loads() {
        let (data, targets) = samples.stacked()?;
        let covariance = at.multi_task_covariance()?;
        let options = LikelihoodOptions::automatic();
        evidence(&covariance, at.noise_std, data.inputs(), &targets, options)?
    } else if at.has_only_smooth_part() {
        evidence(&at.smooth_part()?, at.noise_std, x, targets, options)?
    } else {
        evidence(&at.torque_covariance()?, at.noise_std, x, targets, options)?
    };
    Ok(evidence.evaluation.log_marginal_likelihood)
}
