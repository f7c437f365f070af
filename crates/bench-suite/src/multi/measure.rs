//! One unit from data to record: fit every model, predict every context, score.

use std::collections::BTreeMap;
use std::time::Instant;

use faer::{Mat, MatRef};
use mtgp::{MultiTaskOptions, Stacked, StageOne, TaskFit, fit_ranks};

use super::draw::nested;
use super::model::MultiModel;
use super::rigid_body;
use super::summary::summary_of;
use super::unit::{ContextScore, ModelRecord, Unit, UnitRecord};
use crate::cell::ModelKind;
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::models::Fitted;
use crate::rigid_body::rows::{Regressors, States};
use crate::split::{N_ROWS, Split};

/// What all units share.
pub struct Bench<'a> {
    data: &'a DataSet,
    regressors: Regressors<'a>,
    /// Splits by seed and load.
    splits: BTreeMap<&'a str, BTreeMap<usize, Split>>,
    /// Inputs of every row of the data set, (64,000, 18): every context is predicted there.
    x_all: Mat<f64>,
}

impl<'a> Bench<'a> {
    /// Data and the splits of every seed and load.
    pub fn new(data: &'a DataSet, splits: BTreeMap<&'a str, BTreeMap<usize, Split>>) -> Self {
        let rows: Vec<usize> = (0..N_ROWS).collect();
        Self {
            data,
            regressors: Regressors::new(data),
            splits,
            x_all: data.x(&rows),
        }
    }

    /// Inputs of every row of the data set, (64,000, 18).
    pub(super) fn x_all(&self) -> MatRef<'_, f64> {
        self.x_all.as_ref()
    }

    /// A joint's regressor at rows of the data set.
    pub(super) fn states(&self, joint: usize, rows: &[usize]) -> States {
        self.regressors.states(joint, rows)
    }

    fn split(&self, unit: &Unit, load: usize) -> &Split {
        &self.splits[unit.split_seed.as_str()][&load]
    }

    /// nMSE of every context from its predictions at all rows.
    ///
    /// # Shapes
    /// `predictions` (64,000, m).
    pub(super) fn scores(
        &self,
        unit: &Unit,
        predictions: &Mat<f64>,
    ) -> Result<Vec<ContextScore>, BenchError> {
        let of_context = |task: usize| {
            let context = task + 1;
            let split = self.split(unit, context);
            let means = predictions.col_as_slice(task);
            let on = |rows: &[usize]| {
                let picked: Vec<f64> = rows.iter().map(|&row| means[row]).collect();
                nmse(&picked, &self.data.torques(context, unit.joint, rows))
            };
            Ok(ContextScore {
                context,
                interp: on(&split.interp)?,
                extrap: on(&split.extrap)?,
            })
        };
        (0..unit.n_contexts).map(of_context).collect()
    }
}

/// Training samples of a unit, those of each context together.
pub(super) struct Training {
    /// Training rows of each context.
    pub rows: Vec<Vec<usize>>,
    pub stacked: Stacked,
    /// In the order of `stacked`.
    pub targets: Vec<f64>,
}

impl Training {
    pub fn draw(unit: &Unit, bench: &Bench<'_>) -> Result<Self, BenchError> {
        let contexts = 1..=unit.n_contexts;
        let draw = |load| {
            let split = bench.split(unit, load);
            nested(split, &unit.seed, load, unit.repeat, unit.n_each())
        };
        let rows: Vec<Vec<usize>> = contexts.map(draw).collect();
        let mut tasks = Vec::new();
        let mut targets = Vec::new();
        for (task, rows) in rows.iter().enumerate() {
            tasks.extend(std::iter::repeat_n(task, rows.len()));
            targets.extend(bench.data.torques(task + 1, unit.joint, rows));
        }
        let x = bench.data.x(&rows.concat());
        let stacked = Stacked::new(x.as_ref(), &tasks, unit.n_contexts)?;
        let targets = stacked.stack(&targets);
        Ok(Self {
            rows,
            stacked,
            targets,
        })
    }
}

/// Fits and scores all models of a unit; sequential, and the same bits on every call but for the seconds.
///
/// pGP and iGP are learned once; the mGPs are searched together, and each counts an equal
/// part of their seconds.
///
/// # Errors
/// `Fit` or `MultiTask` if a model cannot be fitted; the errors of [`nmse`].
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
            MultiModel::RigidBody | MultiModel::RigidBodyAndProcess => continue,
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
    let predictions = fit.predict_mean_of_all_tasks(bench.x_all.as_ref())?;
    let seconds_predict = start.elapsed().as_secs_f64();
    let task_factor = fit.lambda().map_or_else(Vec::new, |lambda| {
        let row = |i: usize| lambda.row(i).iter().copied().collect();
        (0..lambda.nrows()).map(row).collect()
    });
    Ok(ModelRecord {
        model,
        log_marginal_likelihood: fit.log_marginal(),
        seconds_fit,
        seconds_predict,
        task_factor,
        scores: bench.scores(unit, &predictions)?,
        fits: vec![summary_of(fit)],
    })
}

/// sGP: a GPc of section 3.4 for each context on its own.
fn single(unit: &Unit, bench: &Bench<'_>, training: &Training) -> Result<ModelRecord, BenchError> {
    let mut predictions = Mat::zeros(N_ROWS, unit.n_contexts);
    let (mut seconds_fit, mut seconds_predict) = (0.0, 0.0);
    let mut fits = Vec::new();
    for (task, rows) in training.rows.iter().enumerate() {
        let start = Instant::now();
        let targets = bench.data.torques(task + 1, unit.joint, rows);
        let x = bench.data.x(rows);
        let fitted = Fitted::fit(ModelKind::GpCoulomb, x.as_ref(), &targets)?;
        seconds_fit += start.elapsed().as_secs_f64();

        let start = Instant::now();
        let means = fitted.predict_mean(bench.x_all.as_ref())?;
        predictions.col_as_slice_mut(task).copy_from_slice(&means);
        seconds_predict += start.elapsed().as_secs_f64();
        fits.extend(fitted.summary());
    }
    Ok(ModelRecord {
        model: MultiModel::Single,
        log_marginal_likelihood: fits.iter().map(|fit| fit.log_marginal_likelihood).sum(),
        seconds_fit,
        seconds_predict,
        task_factor: Vec::new(),
        scores: bench.scores(unit, &predictions)?,
        fits,
    })
}
