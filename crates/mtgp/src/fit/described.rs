//! Learning a K^ρ of the tasks' descriptors, on more and more of the samples.

use faer::Mat;
use gp_core::search::{Origin, Plan, Start, climb};
use gp_core::{LogMarginal, Starts};

use super::options::MultiTaskOptions;
use super::parts::smaller_parts;
use super::staged::StageOne;
use super::task_fit::TaskFit;
use crate::error::{MtgpError, require_count};
use crate::prior::{DescribedParams, DescribedTasks, MultiTaskCovariance, Stacked, TaskCovariance};

/// Parts of the variance that a start gives to what no descriptor changes: half, or nearly all.
const SHARED: [f64; 2] = [0.5, 0.9];

/// Part of it that a start gives to what is not affine in the descriptors.
const CURVED: f64 = 0.01;

/// What is known of the tasks beforehand.
#[derive(Debug, Clone, PartialEq)]
pub struct Descriptors {
    /// A row for each task, (m, d).
    pub values: Mat<f64>,
    /// How far apart tasks typically are in each, above zero, (d,).
    pub units: Vec<f64>,
}

/// Learns a K^ρ of the tasks' descriptors: [`DescribedTasks`].
///
/// The search sets out from θ^x of pGP and of iGP on the smallest part of the data (A.3, step 1), each with K^ρ half
/// and nearly all of what the tasks share; the highest goes on, on more and more of the samples as for
/// [`super::fit_ranks`].
/// With [`Starts::Chapter`] from the higher of pGP and iGP alone, on all samples.
/// # Shapes
/// `targets` (n,), N·m, in the order of the rows of `data`.
/// # Errors
/// [`MtgpError::CountMismatch`] unless there is a row of descriptors for each task, and a target for each row;
/// as for [`DescribedTasks::new`] and [`super::fit_pooled`].
pub fn fit_described(
    data: &Stacked,
    targets: &[f64],
    descriptors: &Descriptors,
    options: &MultiTaskOptions,
) -> Result<TaskFit, MtgpError> {
    let n_rows = descriptors.values.nrows();
    require_count("rows of descriptors", n_rows, data.n_tasks())?;
    let n_units = descriptors.units.len();
    require_count("units of descriptors", n_units, descriptors.values.ncols())?;
    let mut parts = smaller_parts(data, targets, options)?;
    parts.push((data.clone(), targets.to_vec()));
    let (first, of_first) = &parts[0];
    let stage_one = StageOne::new(first, of_first, options)?;
    let starts = starts(&stage_one, descriptors, options.starts)?;

    let on_part = |idx: usize| {
        let (part, of_part): &(Stacked, Vec<f64>) = &parts[idx];
        LogMarginal::new(part.inputs(), of_part, options.likelihood)
    };
    let stages = (parts.iter()).map(|(_, of_part)| options.on(of_part.len()).stage(of_part.len()));
    let found = climb(on_part, &starts, &Plan::in_stages(stages.collect()))?;
    TaskFit::new(data, targets, found, options.likelihood)
}

/// Where the search sets out.
fn starts(
    stage_one: &StageOne,
    descriptors: &Descriptors,
    starts: Starts,
) -> Result<Vec<Start<MultiTaskCovariance>>, MtgpError> {
    let models = match starts {
        Starts::Chapter => vec![stage_one.winner()],
        Starts::Several => vec![&stage_one.pooled, &stage_one.independent],
    };
    let noise_std = stage_one.initial_noise_std;
    let mut starts = Vec::new();
    for model in models {
        for shared in SHARED {
            let params = start_params(descriptors.units.as_slice(), shared);
            let tasks = DescribedTasks::new(descriptors.values.clone(), params)?;
            let input = model.covariance().input().clone();
            let task = TaskCovariance::Described(tasks);
            let covariance = MultiTaskCovariance::new(input, task);
            starts.push(Start::new(Origin::Described, covariance, noise_std));
        }
    }
    Ok(starts)
}

/// A variance of about one between them, of which descriptors have equal parts; typical tasks are one length apart.
fn start_params(units: &[f64], shared: f64) -> DescribedParams {
    let d = units.len() as f64;
    let of_each = ((1.0 - shared) / d).sqrt();
    DescribedParams {
        bias_std: shared.sqrt(),
        linear_std: units.iter().map(|unit| of_each / unit).collect(),
        signal_std: CURVED.sqrt(),
        length_scales: units.iter().map(|unit| d.sqrt() * unit).collect(),
    }
}
