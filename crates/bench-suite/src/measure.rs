//! One cell from data to record: fit, predict, score.

use std::time::Instant;

use crate::cell::{Cell, CellRecord};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::fit_summary::FitSummary;
use crate::metrics::nmse_of_sets;
use crate::models::Fitted;
use crate::rigid_body::parameters::Knowledge;
use crate::rigid_body::rows::Regressors;
use crate::rigid_body::{JointModel, RigidBodyForm, RigidBodyKind, Terms, shared};
use crate::split::Split;

/// Fits and scores a cell; sequential, and the same bits on every call but for the seconds.
///
/// # Errors
/// `Fit` if the model cannot be fitted; the errors of [`nmse_of_sets`].
/// # Panics
/// If the data set does not hold the cell's load.
pub fn measure(
    cell: &Cell,
    data: &DataSet,
    regressors: &Regressors<'_>,
    split: &Split,
) -> Result<CellRecord, BenchError> {
    let train = split.subset(&cell.seed, cell.load, cell.n);
    let targets = data.torques(cell.load, cell.joint, &train);
    let learned = match cell.model.rigid_body() {
        None => of_states(cell, data, (&train, &targets), &split.extrap)?,
        Some(RigidBodyKind::OfRobot(terms)) => of_robot(cell, terms, data, &train, &split.extrap)?,
        Some(RigidBodyKind::OfJoint(form)) => {
            let train = (&train[..], &targets[..]);
            of_rigid_body(cell, form, regressors, train, &split.extrap)?
        }
    };

    let truth = data.torques(cell.load, cell.joint, &split.extrap);
    let [nmse_interp, nmse_extrap] = nmse_of_sets(split, &learned.means, &truth)?;
    Ok(CellRecord {
        nmse_interp,
        nmse_extrap,
        seconds_fit: learned.seconds_fit,
        seconds_predict: learned.seconds_predict,
        cell: cell.clone(),
        fit: learned.fit,
    })
}

/// What a model predicts, and how it came about.
struct Learned {
    means: Vec<f64>,
    fit: Option<FitSummary>,
    seconds_fit: f64,
    seconds_predict: f64,
}

/// A model of section 3.4.
fn of_states(
    cell: &Cell,
    data: &DataSet,
    (train, targets): (&[usize], &[f64]),
    test: &[usize],
) -> Result<Learned, BenchError> {
    let start = Instant::now();
    let model = Fitted::fit(cell.model, data.x(train).as_ref(), targets)?;
    let seconds_fit = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let means = model.predict_mean(data.x(test).as_ref())?;
    Ok(Learned {
        means,
        fit: model.summary(),
        seconds_fit,
        seconds_predict: start.elapsed().as_secs_f64(),
    })
}

/// A model with the prior of section 3.2.
fn of_rigid_body(
    cell: &Cell,
    form: RigidBodyForm,
    regressors: &Regressors<'_>,
    (train, targets): (&[usize], &[f64]),
    test: &[usize],
) -> Result<Learned, BenchError> {
    let [train, test] = [train, test].map(|rows| regressors.states(cell.joint, rows));
    let start = Instant::now();
    let model = JointModel::of_one_load(cell.joint, Knowledge::Nominal);
    let model = model.fit(form, &train, targets, &[])?;
    let seconds_fit = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let means = model.predict_mean(&test)?;
    Ok(Learned {
        means,
        fit: Some(model.summary()),
        seconds_fit,
        seconds_predict: start.elapsed().as_secs_f64(),
    })
}

/// All joints together, of which the cell's is predicted; the seconds of the fit are those of all.
fn of_robot(
    cell: &Cell,
    terms: Terms,
    data: &DataSet,
    train: &[usize],
    test: &[usize],
) -> Result<Learned, BenchError> {
    let samples = shared::samples(data, &[(cell.load, train)]);
    let start = Instant::now();
    let model = terms.learn(&samples)?;
    let seconds_fit = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let prediction = model.predict_joint(cell.joint - 1, 0, data.x(test).as_ref())?;
    Ok(Learned {
        means: prediction.mean,
        fit: None,
        seconds_fit,
        seconds_predict: start.elapsed().as_secs_f64(),
    })
}
