//! One cell from data to record: fit, predict, score.

use std::time::Instant;

use crate::cell::{Cell, CellRecord};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::models::Fitted;
use crate::split::Split;

/// Fits and scores a cell; sequential, and the same bits on every call but for the seconds.
///
/// The extrap set contains the interp set, so one pass over the extrap rows serves both.
///
/// # Errors
/// `Fit` if the model cannot be fitted; the errors of [`nmse`].
/// # Panics
/// If the data set does not hold the cell's load.
pub fn measure(cell: &Cell, data: &DataSet, split: &Split) -> Result<CellRecord, BenchError> {
    let train = split.subset(&cell.seed, cell.load, cell.n);
    let targets = data.torques(cell.load, cell.joint, &train);

    let start = Instant::now();
    let model = Fitted::fit(cell.model, data.x(&train).as_ref(), &targets)?;
    let seconds_fit = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let predictions = model.predict_mean(data.x(&split.extrap).as_ref())?;
    let seconds_predict = start.elapsed().as_secs_f64();

    let truth = data.torques(cell.load, cell.joint, &split.extrap);
    let interp = split.interp_in_extrap();
    let pick = |values: &[f64]| interp.iter().map(|&i| values[i]).collect::<Vec<_>>();
    Ok(CellRecord {
        nmse_interp: nmse(&pick(&predictions), &pick(&truth))?,
        nmse_extrap: nmse(&predictions, &truth)?,
        seconds_fit,
        seconds_predict,
        cell: cell.clone(),
        fit: model.summary(),
    })
}
