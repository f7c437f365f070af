//! One unit from data to record: fit every model, predict every context, score.

use std::time::Instant;

use faer::Mat;
use kernels::Covariance;
use mtgp::{MultiTaskOptions, StageOne, TaskFit, fit_ranks};

use super::bench::{Bench, Training};
use super::model::MultiModel;
use super::rigid_body;
use super::unit::{ModelRecord, Unit, UnitRecord};
use crate::cell::ModelKind;
use crate::error::BenchError;
use crate::fit_summary::FitSummary;
use crate::models::Fitted;
use crate::split::N_ROWS;

/// Fits and scores all models of a unit; sequential, and the same bits on every call but for the seconds.
///
/// pGP and iGP are learned once; the mGPs are searched together, and each counts an equal
/// part of their seconds.
///
/// # Errors
/// `Fit` or `MultiTask` if a model cannot be fitted; the errors of [`crate::metrics::nmse`].
/// # Panics
/// If the bench does not hold the unit's splits and contexts.
/// # Source
/// Section 4.6; A.3.
pub fn measure(unit: &Unit, bench: &Bench<'_>) -> Result<UnitRecord, BenchError> {
    let training = Training::draw(unit, bench)?;
    if unit.is_rigid_body() {
        return rigid_body::measure(unit, bench, &training);
    }
    let options = MultiTaskOptions::several();
    let (stage_one, seconds) = stage_one(&training, &options)?;
    let ranks: Vec<usize> = unit.models.iter().filter_map(|m| m.rank()).collect();
    let start = Instant::now();
    let (data, targets) = (&training.stacked, &training.targets);
    let fits = fit_ranks(data, targets, &ranks, &stage_one, &options)?;
    let seconds_each = start.elapsed().as_secs_f64() / ranks.len().max(1) as f64;
    let mut fits = fits.iter();

    let mut models = Vec::new();
    for &model in &unit.models {
        models.push(match model {
            MultiModel::Single => single(unit, bench, &training)?,
            MultiModel::Pooled => scored(unit, bench, model, &stage_one.pooled, seconds[0])?,
            MultiModel::Independent => {
                scored(unit, bench, model, &stage_one.independent, seconds[1])?
            }
            MultiModel::Transfer { .. } => {
                let fit = fits.next().expect("one fit a rank");
                scored(unit, bench, model, fit, seconds_each)?
            }
            MultiModel::RigidBodyAndProcess | MultiModel::Shared(_) => continue,
        });
    }
    Ok(UnitRecord {
        unit: unit.clone(),
        models,
    })
}

/// Steps 1 and 2 of A.3, with the seconds of pGP and of iGP; the latter's take in step 2.
fn stage_one(
    training: &Training,
    options: &MultiTaskOptions,
) -> Result<(StageOne, [f64; 2]), BenchError> {
    let (data, targets) = (&training.stacked, &training.targets);
    let start = Instant::now();
    let pooled = mtgp::fit_pooled(data, targets, options)?;
    let seconds_pooled = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let independent = mtgp::fit_independent(data, targets, options)?;
    let stage_one = StageOne::from_fits(data, targets, pooled, independent, options)?;
    Ok((stage_one, [seconds_pooled, start.elapsed().as_secs_f64()]))
}

/// Predictions and scores of a model of all contexts.
fn scored(
    unit: &Unit,
    bench: &Bench<'_>,
    model: MultiModel,
    fit: &TaskFit,
    seconds_fit: f64,
) -> Result<ModelRecord, BenchError> {
    let start = Instant::now();
    let predictions = fit.predict_mean_of_all_tasks(bench.x_all())?;
    let seconds_predict = start.elapsed().as_secs_f64();
    let task_factor = fit.lambda().map_or_else(Vec::new, |lambda| {
        let row = |i: usize| lambda.row(i).iter().copied().collect();
        (0..lambda.nrows()).map(row).collect()
    });
    // Those of c^x: Λ has a place of its own.
    let hyperparameters = fit.covariance().input().params();
    let summary = FitSummary::of(&fit.report, fit.noise_std(), hyperparameters);
    Ok(ModelRecord {
        model,
        log_marginal_likelihood: Some(fit.log_marginal()),
        seconds_fit,
        seconds_predict,
        task_factor,
        scores: bench.scores(unit, &predictions)?,
        fits: vec![summary],
    })
}

/// sGP: a GPc of section 3.4 for each context on its own.
fn single(unit: &Unit, bench: &Bench<'_>, training: &Training) -> Result<ModelRecord, BenchError> {
    let mut predictions = Mat::zeros(N_ROWS, unit.n_contexts);
    let (mut seconds_fit, mut seconds_predict) = (0.0, 0.0);
    let mut fits = Vec::new();
    for (task, rows) in training.rows.iter().enumerate() {
        let start = Instant::now();
        let targets = bench.data().torques(task + 1, unit.joint, rows);
        let x = bench.data().x(rows);
        let fitted = Fitted::fit(ModelKind::GpCoulomb, x.as_ref(), &targets)?;
        seconds_fit += start.elapsed().as_secs_f64();

        let start = Instant::now();
        let means = fitted.predict_mean(bench.x_all())?;
        predictions.col_as_slice_mut(task).copy_from_slice(&means);
        seconds_predict += start.elapsed().as_secs_f64();
        fits.extend(fitted.summary());
    }
    Ok(ModelRecord {
        model: MultiModel::Single,
        log_marginal_likelihood: Some(fits.iter().map(|fit| fit.log_marginal_likelihood).sum()),
        seconds_fit,
        seconds_predict,
        task_factor: Vec::new(),
        scores: bench.scores(unit, &predictions)?,
        fits,
    })
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, BTreeSet};

    use mtgp::Criterion;
    use torque_model::learn::{ManyContexts, Ranks, Tasks};
    use torque_model::{ContinuousJoints, JointTorques, Provenance, RobotModel, Samples, Timeline};

    use super::*;
    use crate::dataset::DataSet;
    use crate::multi::ranks::Choices;
    use crate::split::Split;

    /// Joint 3 of three contexts with six samples each.
    fn unit() -> Unit {
        Unit {
            seed: "test".to_string(),
            split_seed: "split".to_string(),
            repeat: 0,
            joint: 3,
            n_contexts: 3,
            n_total: 18,
            models: ["mGP-1", "mGP-2", "mGP-3"]
                .map(|name| name.parse().expect("a model's name"))
                .to_vec(),
        }
    }

    /// The samples of a unit as a user would have them.
    fn samples(unit: &Unit, training: &Training) -> Samples {
        let numbered = |name: &str, n: usize| (1..=n).map(|i| format!("{name}{i}")).collect();
        Samples {
            joint_names: numbered("joint", 6),
            contexts: numbered("c", unit.n_contexts),
            context_of: training.stacked.tasks().to_vec(),
            x: training.stacked.covariates().to_owned(),
            torques: vec![JointTorques {
                joint_idx: unit.joint - 1,
                values: training.targets.clone(),
            }],
            timeline: Timeline::default(),
            continuous: ContinuousJoints::none(),
        }
    }

    #[test]
    fn ranks_are_learned_and_chosen_as_a_user_has_them() {
        let unit = unit();
        let data = DataSet::simulate(&BTreeSet::from([1, 2, 3])).unwrap();
        let splits = (1..=3).map(|load| (load, Split::draw(&unit.split_seed, load)));
        let splits = BTreeMap::from([(unit.split_seed.as_str(), splits.collect())]);
        let bench = Bench::new(&data, splits);
        let record = measure(&unit, &bench).unwrap();
        let choices = Choices::of(std::slice::from_ref(&record)).unwrap();
        let choice = &choices.0[&(0, 18)];

        let training = Training::draw(&unit, &bench).unwrap();
        let learner = ManyContexts {
            tasks: Tasks::Transfer(Ranks::Chosen(Criterion::Bic)),
            options: MultiTaskOptions::several(),
        };
        let provenance = Provenance::new("test", b"");
        let model = RobotModel::learn(&samples(&unit, &training), &learner, provenance).unwrap();
        let selection = model.parts().selection.as_ref().unwrap();
        assert_eq!(selection.values, choice.bic);
        let (_, process) = model.tasks().next().unwrap();
        assert_eq!(process.name(), format!("mGP-{}", choice.rank));
        let kept = choices.chosen(&record).unwrap();
        let found = process.summary.log_marginal;
        assert_eq!(
            Some(found.to_bits()),
            kept.log_marginal_likelihood.map(f64::to_bits)
        );
    }
}
