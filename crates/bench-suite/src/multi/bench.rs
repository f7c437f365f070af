//! What the units of a run share, and the training samples of one of them.

use std::collections::BTreeMap;

use faer::{Mat, MatRef};
use mtgp::Stacked;

use super::draw::nested;
use super::unit::{ContextScore, Unit};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::metrics::nmse;
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

    /// States and torques.
    pub(super) fn data(&self) -> &DataSet {
        self.data
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

    /// nMSE of every context of a unit, as [`context_scores`].
    pub(super) fn scores(
        &self,
        unit: &Unit,
        predictions: &Mat<f64>,
    ) -> Result<Vec<ContextScore>, BenchError> {
        let splits = (1..=unit.n_contexts).map(|context| self.split(unit, context));
        context_scores(self.data, unit.joint, splits, predictions)
    }
}

/// nMSE of every context of a joint, from 1, from its predictions at all rows.
///
/// # Shapes
/// `splits` m of them; `predictions` (64,000, m).
/// # Errors
/// Those of [`nmse`].
pub fn context_scores<'a>(
    data: &DataSet,
    joint: usize,
    splits: impl IntoIterator<Item = &'a Split>,
    predictions: &Mat<f64>,
) -> Result<Vec<ContextScore>, BenchError> {
    let of_context = |(task, split): (usize, &Split)| {
        let context = task + 1;
        let means = predictions.col_as_slice(task);
        let on = |rows: &[usize]| {
            let picked: Vec<f64> = rows.iter().map(|&row| means[row]).collect();
            nmse(&picked, &data.torques(context, joint, rows))
        };
        Ok(ContextScore {
            context,
            interp: on(&split.interp)?,
            extrap: on(&split.extrap)?,
        })
    };
    splits.into_iter().enumerate().map(of_context).collect()
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
