//! Many loads: parameters of links and drives are shared, each load has ten of its own.

use faer::Mat;
use gp_core::{InformedFit, RegressorSamples, fit_rigid_body, fit_rigid_body_and_process};
use kernels::{Covariance, TorqueForm};
use mtgp::TaskProcess;
use puma_dyn::Scenario;

use super::line::Line;
use super::one_load::{options, predict};
use super::parameters::{self, Knowledge};
use super::rows;
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::section5::bench::Bench;
use crate::section5::trained::Trained;
use crate::section5::training_set::{SPLIT_SEED, TrainingSet};
use crate::split::Split;

/// Scores of all models of a joint, averaged over the loads.
///
/// # Errors
/// `Fit`, `MultiTask`, and those of [`nmse`].
pub fn lines(
    bench: &Bench,
    set: &TrainingSet,
    trained: &Trained,
    joint: usize,
) -> Result<Vec<Line>, BenchError> {
    let test = TestSets::new(bench, joint, set.n_contexts);
    let line = |model: String, [interp, extrap]: [f64; 2], noise_std: f64| Line {
        n_loads: set.n_contexts,
        joint,
        n: set.n_total,
        model,
        interp,
        extrap,
        noise_std,
    };
    let mut lines = Vec::new();
    for model in [&trained.mgp, &trained.igp, &trained.pgp] {
        let process = model.learned().iter().find(|(idx, _)| idx + 1 == joint);
        let (_, process) = process.expect("every joint is learned");
        let scores = test.scores(|task, x, _| predict_task(process, task, x))?;
        lines.push(line(process.name(), scores, process.noise_var().sqrt()));
    }

    let samples = set.samples(&bench.data)?;
    let targets = samples.targets(&bench.data, joint);
    let arm = rows::of_arm(&test.scenario, &bench.data, joint, &samples.rows.concat());
    let regressor = rows::with_loads(&arm, samples.stacked.tasks(), set.n_contexts);
    let samples = RegressorSamples {
        x: samples.x.as_ref(),
        regressor: regressor.as_ref(),
        targets: &targets,
    };
    for knowledge in Knowledge::ALL {
        let model = test.scenario.model();
        let prior = parameters::of_arm_and_loads(model, knowledge, set.n_contexts);
        let alone = fit_rigid_body(samples, &prior, &options())?;
        let name = format!("rbd{}", knowledge.label());
        let noise_std = alone.fit.posterior.noise_std();
        lines.push(line(name, test.informed(&alone)?, noise_std));

        let form = TorqueForm::Coulomb;
        let both = fit_rigid_body_and_process(samples, &prior, form, &options())?;
        let name = format!("rbd+gp{}", knowledge.label());
        let noise_std = both.fit.posterior.noise_std();
        lines.push(line(name, test.informed(&both)?, noise_std));
    }
    Ok(lines)
}

fn predict_task(process: &TaskProcess, task: usize, x: &Mat<f64>) -> Result<Vec<f64>, BenchError> {
    let rows = process.covariance().rows_of(x.as_ref(), task)?;
    Ok(process.posterior.predict_mean(rows.as_ref())?)
}

/// Test sets of all loads.
struct TestSets<'a> {
    bench: &'a Bench,
    scenario: Scenario,
    joint: usize,
    splits: Vec<Split>,
}

impl<'a> TestSets<'a> {
    fn new(bench: &'a Bench, joint: usize, n_loads: usize) -> Self {
        let loads = 1..=n_loads;
        Self {
            bench,
            scenario: Scenario::reference(),
            joint,
            splits: loads.map(|load| Split::draw(SPLIT_SEED, load)).collect(),
        }
    }

    /// interp and extrap, averaged over the loads, of means at rows of a task.
    fn scores(
        &self,
        predict: impl Fn(usize, &Mat<f64>, &[usize]) -> Result<Vec<f64>, BenchError>,
    ) -> Result<[f64; 2], BenchError> {
        let mut sums = [0.0; 2];
        for (task, split) in self.splits.iter().enumerate() {
            let rows = &split.extrap;
            let means = predict(task, &self.bench.data.x(rows), rows)?;
            let truth = self.bench.data.torques(task + 1, self.joint, rows);
            let places = split.interp_in_extrap();
            let at = |values: &[f64]| places.iter().map(|&i| values[i]).collect::<Vec<f64>>();
            let m = self.splits.len() as f64;
            sums[0] += nmse(&at(&means), &at(&truth))? / m;
            sums[1] += nmse(&means, &truth)? / m;
        }
        Ok(sums)
    }

    fn informed<C: Covariance>(&self, model: &InformedFit<C>) -> Result<[f64; 2], BenchError> {
        self.scores(|task, x, rows| {
            let arm = rows::of_arm(&self.scenario, &self.bench.data, self.joint, rows);
            let tasks = vec![task; rows.len()];
            let regressor = rows::with_loads(&arm, &tasks, self.splits.len());
            Ok(predict(model, x.as_ref(), &regressor)?)
        })
    }
}
