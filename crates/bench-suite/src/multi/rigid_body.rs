//! A unit of the models with the prior of section 3.2: arm and drives are shared, each load has ten
//! parameters of its own, and the process of rbd+gp is the same under all loads; or all joints share them, too.

use std::time::Instant;

use super::bench::{Bench, Training};
use super::model::MultiModel;
use super::unit::{ModelRecord, Unit, UnitRecord};
use crate::error::BenchError;
use crate::rigid_body::parameters::Knowledge;
use crate::rigid_body::{JointModel, RigidBodyForm, RigidBodyKind, Terms, shared};
use crate::split::N_ROWS;

/// Fits and scores the models of a unit; sequential.
///
/// # Errors
/// `Fit`; the errors of [`crate::metrics::nmse`].
/// # Source
/// Sec. 3.2, with the loads of eqs. (10)–(12).
pub(super) fn measure(
    unit: &Unit,
    bench: &Bench<'_>,
    training: &Training,
) -> Result<UnitRecord, BenchError> {
    let models = unit.models.iter();
    let records = models.map(|&model| model_record(unit, bench, training, model));
    Ok(UnitRecord {
        models: records
            .filter_map(Result::transpose)
            .collect::<Result<_, _>>()?,
        unit: unit.clone(),
    })
}

fn model_record(
    unit: &Unit,
    bench: &Bench<'_>,
    training: &Training,
    model: MultiModel,
) -> Result<Option<ModelRecord>, BenchError> {
    match model.rigid_body() {
        None => Ok(None),
        Some(RigidBodyKind::OfJoint(form)) => {
            of_joint(unit, bench, training, model, form).map(Some)
        }
        Some(RigidBodyKind::OfRobot(terms)) => of_robot(unit, bench, training, terms).map(Some),
    }
}

/// The unit's joint by itself.
fn of_joint(
    unit: &Unit,
    bench: &Bench<'_>,
    training: &Training,
    model: MultiModel,
    form: RigidBodyForm,
) -> Result<ModelRecord, BenchError> {
    let samples = bench.states(unit.joint, &training.rows.concat());
    let start = Instant::now();
    let prior = JointModel::of_loads(unit.joint, Knowledge::Nominal, unit.n_contexts);
    let (targets, loads) = (&training.targets, training.stacked.tasks());
    let fit = prior.fit(form, &samples, targets, loads)?;
    let seconds_fit = start.elapsed().as_secs_f64();

    let all = bench.states(unit.joint, &(0..N_ROWS).collect::<Vec<_>>());
    let start = Instant::now();
    let means = fit.predict_mean_of_loads(&all)?;
    let seconds_predict = start.elapsed().as_secs_f64();
    let summary = fit.summary();
    Ok(ModelRecord {
        model,
        log_marginal_likelihood: Some(summary.log_marginal_likelihood),
        seconds_fit,
        seconds_predict,
        task_factor: Vec::new(),
        scores: bench.scores(unit, &means)?,
        fits: vec![summary],
    })
}

/// All joints together, of which the unit's is predicted; the seconds of the fit are those of all.
fn of_robot(
    unit: &Unit,
    bench: &Bench<'_>,
    training: &Training,
    terms: Terms,
) -> Result<ModelRecord, BenchError> {
    let loads: Vec<(usize, &[usize])> = (1..=unit.n_contexts)
        .zip(training.rows.iter().map(Vec::as_slice))
        .collect();
    let samples = shared::samples(bench.data(), &loads);
    let start = Instant::now();
    let model = terms.learn(&samples)?;
    let seconds_fit = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let means = shared::joint_of(&model, unit.joint).predict_mean_of_all_contexts(bench.x_all())?;
    Ok(ModelRecord {
        model: MultiModel::Shared(terms),
        log_marginal_likelihood: None,
        seconds_fit,
        seconds_predict: start.elapsed().as_secs_f64(),
        task_factor: Vec::new(),
        scores: bench.scores(unit, &means)?,
        fits: Vec::new(),
    })
}
