//! This project's dense and certified paths.

use std::collections::BTreeMap;
use std::time::Instant;

use anyhow::Result;
use gp_core::{LikelihoodOptions, LogMarginal, Method};
use kernels::Covariance;

use crate::contestant::{Answer, Contestant};
use crate::data::Samples;
use crate::hyperparameters::Hyperparameters;

/// How much one evaluation may take over from the one before.
enum Start {
    /// Nothing: memory is allocated and pivots are searched anew.
    Cold,
    /// Memory and pivots, as inside a fit.
    Warm,
}

/// One path of gp-core.
pub struct Ours<'a> {
    samples: &'a Samples,
    options: LikelihoodOptions,
    start: Start,
    likelihood: LogMarginal<'a>,
}

impl<'a> Ours<'a> {
    /// The dense path, with memory kept from one evaluation to the next.
    pub fn dense(samples: &'a Samples) -> Self {
        Self::new(samples, LikelihoodOptions::dense(), Start::Warm)
    }

    /// The low-rank path from nothing, with an error of at most `certificate` nats.
    pub fn certified(samples: &'a Samples, certificate: f64) -> Self {
        Self::new(samples, low_rank(certificate), Start::Cold)
    }

    /// The low-rank path as a fit uses it.
    pub fn warm(samples: &'a Samples, certificate: f64) -> Self {
        Self::new(samples, low_rank(certificate), Start::Warm)
    }

    fn new(samples: &'a Samples, options: LikelihoodOptions, start: Start) -> Self {
        Self {
            samples,
            options,
            start,
            likelihood: LogMarginal::new(samples.x.as_ref(), &samples.targets, options),
        }
    }

    fn answer<C: Covariance>(&mut self, covariance: &C, noise_std: f64) -> Result<Answer> {
        let mut gradient = vec![0.0; covariance.n_params() + 1];
        let clock = Instant::now();
        if let Start::Cold = self.start {
            let (x, targets) = (self.samples.x.as_ref(), &self.samples.targets);
            self.likelihood = LogMarginal::new(x, targets, self.options);
        }
        let found = (self.likelihood).evaluate(covariance, noise_std, &mut gradient)?;
        let seconds = clock.elapsed().as_secs_f64();
        Ok(Answer {
            seconds,
            value: found.log_marginal_likelihood,
            error_bound: Some(found.error_bound),
            rank: found.rank,
            gradient: by_name(covariance, &gradient),
        })
    }
}

fn low_rank(certificate: f64) -> LikelihoodOptions {
    LikelihoodOptions {
        method: Method::Certified,
        certificate,
    }
}

/// The gradient with respect to (θ, σ) by the names of the hyperparameters.
fn by_name<C: Covariance>(covariance: &C, gradient: &[f64]) -> BTreeMap<String, Vec<f64>> {
    let layout = covariance.layout();
    let names = layout.specs().iter().map(|spec| spec.name);
    let mut named = BTreeMap::new();
    for (name, &component) in names.chain(["noise_std"]).zip(gradient) {
        let components: &mut Vec<f64> = named.entry(name.to_owned()).or_default();
        components.push(component);
    }
    named
}

impl Contestant for Ours<'_> {
    fn evaluate(&mut self, at: &Hyperparameters) -> Result<Answer> {
        if at.has_several_loads() {
            self.answer(&at.multi_task_covariance()?, at.noise_std)
        } else if at.has_only_smooth_part() {
            self.answer(&at.smooth_part()?, at.noise_std)
        } else {
            self.answer(&at.torque_covariance()?, at.noise_std)
        }
    }
}
