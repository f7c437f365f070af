//! One load: the rows beside GPc's of table 3.

use faer::{Mat, MatRef};
use gp_core::{
    FitOptions, GpError, InformedFit, RegressorSamples, Starts, fit, fit_rigid_body,
    fit_rigid_body_and_process,
};
use kernels::{Covariance, TorqueForm};
use puma_dyn::Scenario;

use super::line::Line;
use super::parameters::{self, Knowledge};
use super::rows;
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::section5::bench::Bench;
use crate::section5::training_set::SPLIT_SEED;
use crate::split::Split;

/// Searches from the start of eq. (22) alone for the process beside a rigid-body model.
pub fn options() -> FitOptions {
    FitOptions {
        starts: Starts::Chapter,
        ..FitOptions::several()
    }
}

/// Scores of a model on one load: interp, extrap, σ.
type Scores = [f64; 3];

/// All models of a joint at one size, averaged over the loads.
///
/// # Errors
/// `Fit`, and those of [`nmse`].
pub fn lines(
    bench: &Bench,
    loads: &[usize],
    joint: usize,
    n: usize,
) -> Result<Vec<Line>, BenchError> {
    let mut sums: Vec<(String, Scores)> = Vec::new();
    for &load in loads {
        for (idx, (model, scores)) in of_load(bench, load, joint, n)?.into_iter().enumerate() {
            if sums.len() == idx {
                sums.push((model, [0.0; 3]));
            }
            for (sum, score) in sums[idx].1.iter_mut().zip(scores) {
                *sum += score / loads.len() as f64;
            }
        }
    }
    let line = |(model, [interp, extrap, noise_std]): (String, Scores)| Line {
        n_loads: 1,
        joint,
        n,
        model,
        interp,
        extrap,
        noise_std,
    };
    Ok(sums.into_iter().map(line).collect())
}

fn of_load(
    bench: &Bench,
    load: usize,
    joint: usize,
    n: usize,
) -> Result<Vec<(String, Scores)>, BenchError> {
    let scenario = Scenario::reference();
    let split = Split::draw(SPLIT_SEED, load);
    let subset = split.subset(SPLIT_SEED, load, n);
    let regressor = |rows: &[usize]| rows::of_arm(&scenario, &bench.data, joint, rows);
    let (x, y) = (bench.data.x(&subset), regressor(&subset));
    let (x_test, y_test) = (bench.data.x(&split.extrap), regressor(&split.extrap));
    let targets = bench.data.torques(load, joint, &subset);
    let samples = RegressorSamples {
        x: x.as_ref(),
        regressor: y.as_ref(),
        targets: &targets,
    };
    let truth = bench.data.torques(load, joint, &split.extrap);
    let scored = |means: &[f64], noise_std: f64| scores(&split, means, &truth, noise_std);

    let gp = fit(
        x.as_ref(),
        &targets,
        TorqueForm::Coulomb,
        &FitOptions::several(),
    )?;
    let means = gp.posterior.predict_mean(x_test.as_ref())?;
    let mut all = vec![("GPc".to_string(), scored(&means, gp.noise_std())?)];
    for knowledge in Knowledge::ALL {
        let prior = parameters::of_loaded_arm(scenario.model(), knowledge);
        let alone = fit_rigid_body(samples, &prior, &options())?;
        let means = predict(&alone, x_test.as_ref(), &y_test)?;
        let name = format!("rbd{}", knowledge.label());
        all.push((name, scored(&means, alone.fit.posterior.noise_std())?));

        let both = fit_rigid_body_and_process(samples, &prior, TorqueForm::Coulomb, &options())?;
        let means = predict(&both, x_test.as_ref(), &y_test)?;
        let name = format!("rbd+gp{}", knowledge.label());
        all.push((name, scored(&means, both.fit.posterior.noise_std())?));
    }
    Ok(all)
}

/// Rows that are predicted at a time.
const BLOCK: usize = 4000;

/// Means at all rows, in blocks, so that rows (x, Y) are not all in memory.
///
/// # Errors
/// Those of [`InformedFit::predict_mean`].
pub fn predict<C: Covariance>(
    model: &InformedFit<C>,
    x: MatRef<'_, f64>,
    regressor: &Mat<f64>,
) -> Result<Vec<f64>, GpError> {
    let mut means = Vec::with_capacity(x.nrows());
    for first in (0..x.nrows()).step_by(BLOCK) {
        let count = BLOCK.min(x.nrows() - first);
        let of_block = (x.subrows(first, count), regressor.subrows(first, count));
        means.extend(model.predict_mean(of_block.0, of_block.1)?);
    }
    Ok(means)
}

fn scores(
    split: &Split,
    means: &[f64],
    truth: &[f64],
    noise_std: f64,
) -> Result<Scores, BenchError> {
    let places = split.interp_in_extrap();
    let at = |values: &[f64]| places.iter().map(|&i| values[i]).collect::<Vec<f64>>();
    Ok([
        nmse(&at(means), &at(truth))?,
        nmse(means, truth)?,
        noise_std,
    ])
}
