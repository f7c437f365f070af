//! Many loads: parameters of links and drives are shared, each load has ten of its own.

use torque_model::TorqueFunction;

use super::line::Line;
use crate::error::BenchError;
use crate::metrics::nmse_of_sets;
use crate::rigid_body::parameters::Knowledge;
use crate::rigid_body::rows::Regressors;
use crate::rigid_body::{JointModel, RigidBodyForm};
use crate::section5::bench::Bench;
use crate::section5::trained::{Trained, process_of};
use crate::section5::training_set::{SPLIT_SEED, TrainingSet};
use crate::split::{N_ROWS, Split};

/// Scores of all models of a joint, averaged over the loads.
///
/// # Errors
/// `Fit`, `MultiTask`, and those of [`nmse_of_sets`].
pub fn lines(
    bench: &Bench,
    regressors: &Regressors<'_>,
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
        let process = process_of(model, joint - 1);
        let scores =
            test.scores(|task, rows| Ok(process.predict_mean(task, bench.data.x(rows).as_ref())?))?;
        lines.push(line(process.name(), scores, process.noise_var().sqrt()));
    }

    let samples = set.samples(&bench.data)?;
    let targets = samples.targets(&bench.data, joint);
    let loads = samples.stacked.tasks();
    let states = regressors.states(joint, &samples.rows.concat());
    let all = regressors.states(joint, &(0..N_ROWS).collect::<Vec<_>>());
    for knowledge in Knowledge::ALL {
        for form in RigidBodyForm::ALL {
            let model = JointModel::of_loads(joint, knowledge, set.n_contexts);
            let fit = model.fit(form, &states, &targets, loads)?;
            let name = format!("{}{}", form.name(), knowledge.label());
            let means = fit.predict_mean_of_loads(&all)?;
            let pick = |task: usize, rows: &[usize]| {
                let of_task = means.col_as_slice(task);
                Ok(rows.iter().map(|&row| of_task[row]).collect())
            };
            let scores = test.scores(pick)?;
            lines.push(line(name, scores, fit.noise_std()));
        }
    }
    Ok(lines)
}

/// Test sets of all loads.
struct TestSets<'a> {
    bench: &'a Bench,
    joint: usize,
    splits: Vec<Split>,
}

impl<'a> TestSets<'a> {
    fn new(bench: &'a Bench, joint: usize, n_loads: usize) -> Self {
        let loads = 1..=n_loads;
        Self {
            bench,
            joint,
            splits: loads.map(|load| Split::draw(SPLIT_SEED, load)).collect(),
        }
    }

    /// interp and extrap, averaged over the loads, of means at rows of a task.
    fn scores(
        &self,
        predict: impl Fn(usize, &[usize]) -> Result<Vec<f64>, BenchError>,
    ) -> Result<[f64; 2], BenchError> {
        let mut sums = [0.0; 2];
        for (task, split) in self.splits.iter().enumerate() {
            let rows = &split.extrap;
            let means = predict(task, rows)?;
            let truth = self.bench.data.torques(task + 1, self.joint, rows);
            let scores = nmse_of_sets(split, &means, &truth)?;
            for (sum, score) in sums.iter_mut().zip(scores) {
                *sum += score / self.splits.len() as f64;
            }
        }
        Ok(sums)
    }
}
