//! One K^ρ for all joints of a size: the unit of work, how it is measured, and the record of its result.

use std::fmt;
use std::time::Instant;

use faer::Mat;
use gp_core::search::Start;
use kernels::{Covariance, TorqueCovariance, TorqueForm};
use mtgp::fit::{RankCounts, fit_shared};
use mtgp::{Criterion, MultiTaskCovariance, MultiTaskOptions, TaskCovariance, TaskFactor};
use serde::{Deserialize, Serialize};

use super::bench::{Bench, Training};
use super::model::MultiModel;
use super::unit::{ContextScore, ModelRecord, Unit, UnitRecord};
use crate::cell::TestSet;
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::fit_summary::stop_name;
use crate::store::{Finished, MANY_MEASURED_BY, Work};

/// Evaluations of the sum over the joints that each search may use.
const MAX_EVALUATIONS: usize = 300;

/// Sizes and ranks at which one K^ρ for all joints is learned.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedScope {
    /// Training samples of all contexts together; those of the scope up to here.
    pub up_to: usize,
    /// Ranks among which BIC chooses, all among the scope's.
    pub ranks: Vec<usize>,
}

/// All joints of one size, which set out from the ends of their own fits.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct SharedUnit {
    /// The joints' own units, ascending in the joint.
    pub joints: Vec<Unit>,
    /// Ranks.
    pub ranks: Vec<usize>,
}

impl SharedUnit {
    /// The sizes and repeats at which every joint of the scope has a fit of every rank of its own.
    pub fn all(records: &[UnitRecord], joints: &[usize], scope: &SharedScope) -> Vec<Self> {
        let mut units: Vec<&Unit> = records.iter().map(|record| &record.unit).collect();
        units.retain(|unit| unit.n_total <= scope.up_to && !unit.is_rigid_body());
        let place = |unit: &Unit| (unit.repeat, unit.n_total);
        units.sort_by_key(|unit| (place(unit), unit.joint));
        let groups = units.chunk_by(|a, b| place(a) == place(b));
        let is_whole = |group: &&[&Unit]| {
            let have = |&rank: &usize| {
                let model = MultiModel::Transfer { rank };
                group.iter().all(|unit| unit.models.contains(&model))
            };
            group.len() == joints.len() && scope.ranks.iter().all(have)
        };
        let shared = |group: &[&Unit]| Self {
            joints: group.iter().map(|unit| (*unit).clone()).collect(),
            ranks: scope.ranks.clone(),
        };
        groups.filter(is_whole).map(shared).collect()
    }

    /// The unit of one joint; all are alike but for it.
    fn first(&self) -> &Unit {
        &self.joints[0]
    }

    /// Which draw of the subsets, from 0.
    pub fn repeat(&self) -> usize {
        self.first().repeat
    }

    /// Training samples of all contexts together, of each joint.
    pub fn n_total(&self) -> usize {
        self.first().n_total
    }
}

impl fmt::Display for SharedUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n_joints = self.joints.len();
        let unit = self.first();
        let (m, n) = (unit.n_contexts, unit.n_total);
        write!(f, "one K for {n_joints} joints, {m} contexts, n = {n}")?;
        match unit.repeat {
            0 => Ok(()),
            repeat => write!(f, ", draw {}", repeat + 1),
        }
    }
}

impl Work for SharedUnit {
    type Record = SharedRecord;

    fn key(&self) -> String {
        let joints: Vec<String> = self.joints.iter().map(Work::key).collect();
        format!(
            "format 1; shared by {MANY_MEASURED_BY}; ranks {:?}; {}",
            self.ranks,
            joints.join("; ")
        )
    }

    fn cost(&self) -> impl Ord {
        self.n_total()
    }
}

/// Result of one rank.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedFitRecord {
    /// Columns of Λ.
    pub rank: usize,
    /// log L_i of every joint, natural log.
    pub log_marginals: Vec<f64>,
    /// Σ_i log L_i at the start.
    pub initial_log_marginal: f64,
    /// BIC with one Λ for all joints.
    pub bic: f64,
    /// Evaluations of Σ_i log L_i.
    pub evaluations: usize,
    /// Why the search ended.
    pub stop: String,
    /// Wall-clock seconds of the fit; not reproducible.
    pub seconds_fit: f64,
    /// Λ row by row, one row a context.
    pub task_factor: Vec<Vec<f64>>,
    /// nMSE of every context, of each joint.
    pub scores: Vec<Vec<ContextScore>>,
}

impl SharedFitRecord {
    /// nMSEs of a joint's contexts on a set.
    pub fn nmses(&self, joint_idx: usize, set: TestSet) -> Vec<f64> {
        let scores = self.scores[joint_idx].iter();
        scores.map(|score| score.nmse(set)).collect()
    }
}

/// Result of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SharedRecord {
    /// The unit.
    pub unit: SharedUnit,
    /// Its ranks, in their order.
    pub fits: Vec<SharedFitRecord>,
}

impl SharedRecord {
    /// The rank of least BIC.
    pub fn chosen(&self) -> Option<&SharedFitRecord> {
        let fits = self.fits.iter();
        fits.min_by(|a, b| a.bic.total_cmp(&b.bic).then(a.rank.cmp(&b.rank)))
    }
}

impl Finished for SharedRecord {
    type Work = SharedUnit;

    fn work(&self) -> &SharedUnit {
        &self.unit
    }
}

/// Fits and scores all ranks; sequential, and the same bits on every call but for the seconds.
///
/// # Errors
/// `Experiment` if a joint's own fit is not among `records`; `MultiTask` if there is no likelihood;
/// the errors of [`crate::metrics::nmse`].
/// # Source
/// Sec. 5, first extension.
pub fn measure(
    unit: &SharedUnit,
    records: &[UnitRecord],
    bench: &Bench<'_>,
) -> Result<SharedRecord, BenchError> {
    let training: Vec<Training> = (unit.joints.iter())
        .map(|joint| Training::draw(joint, bench))
        .collect::<Result<_, _>>()?;
    let fits = unit.ranks.iter().map(|&rank| {
        let starts: Vec<Start<MultiTaskCovariance>> = (unit.joints.iter())
            .map(|joint| joint_start(own_fit(joint, rank, records)?))
            .collect::<Result<_, BenchError>>()?;
        fit_rank(unit, rank, &training, &starts, bench)
    });
    Ok(SharedRecord {
        fits: fits.collect::<Result<_, _>>()?,
        unit: unit.clone(),
    })
}

fn fit_rank(
    unit: &SharedUnit,
    rank: usize,
    training: &[Training],
    starts: &[Start<MultiTaskCovariance>],
    bench: &Bench<'_>,
) -> Result<SharedFitRecord, BenchError> {
    let targets: Vec<Vec<f64>> = training.iter().map(|t| t.targets.clone()).collect();
    let options = MultiTaskOptions {
        max_evaluations: MAX_EVALUATIONS,
        ..MultiTaskOptions::several()
    };
    let start = Instant::now();
    let fit = fit_shared(&training[0].stacked, &targets, rank, starts, &options)?;
    let seconds_fit = start.elapsed().as_secs_f64();
    let counts = RankCounts {
        n_tasks: unit.first().n_contexts,
        n_input_params: starts
            .iter()
            .map(|start| start.covariance.input().n_params())
            .collect(),
        n_observations: vec![unit.n_total(); unit.joints.len()],
    };
    let n_observations = counts.n_observations.iter().sum();
    let n_params = counts.n_params_shared(rank);
    let scores = unit.joints.iter().enumerate().map(|(idx, joint)| {
        let means = fit.predict_mean_of_all_tasks(idx, bench.x_all())?;
        bench.scores(joint, &means)
    });
    let lambda = fit.lambda();
    let row = |i: usize| lambda.row(i).iter().copied().collect();
    Ok(SharedFitRecord {
        rank,
        bic: Criterion::Bic.value(fit.log_marginal(), n_params, n_observations),
        initial_log_marginal: fit.initial_log_marginal,
        evaluations: fit.evaluations,
        stop: stop_name(fit.stop).to_string(),
        seconds_fit,
        task_factor: (0..lambda.nrows()).map(row).collect(),
        scores: scores.collect::<Result<_, BenchError>>()?,
        log_marginals: fit.log_marginals,
    })
}

/// A joint's own fit of a rank.
fn own_fit<'a>(
    unit: &Unit,
    rank: usize,
    records: &'a [UnitRecord],
) -> Result<&'a ModelRecord, BenchError> {
    let record = records.iter().find(|record| record.unit == *unit);
    let model = record.and_then(|record| record.of(MultiModel::Transfer { rank }));
    model.ok_or_else(|| {
        let message = format!("{unit}: there is no mGP-{rank} to set out from");
        BenchError::experiment("one K for all joints", message)
    })
}

/// The hyperparameters that a record keeps.
fn joint_start(model: &ModelRecord) -> Result<Start<MultiTaskCovariance>, BenchError> {
    let mut input = TorqueCovariance::unit(N_JOINTS, TorqueForm::Coulomb);
    input.set_params(&model.fits[0].hyperparameters);
    let rows = &model.task_factor;
    let n_cols = rows.first().map_or(0, Vec::len);
    let factor = TaskFactor::new(Mat::from_fn(rows.len(), n_cols, |i, j| rows[i][j]))?;
    Ok(Start::given(
        MultiTaskCovariance::new(input, TaskCovariance::Factor(factor)),
        model.fits[0].noise_std,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::multi::unit::tests::{unit, unit_record};

    #[test]
    fn only_sizes_that_every_joint_has_with_every_rank_are_shared() {
        let record = |joint, n| unit_record(unit(joint, n), &[(0.0, 1.0); 5]);
        let mut records = vec![
            record(1, 280),
            record(3, 280),
            record(1, 364),
            record(1, 1820),
            record(3, 1820),
        ];
        let scope = |ranks: &[usize]| SharedScope {
            up_to: 532,
            ranks: ranks.to_vec(),
        };
        let shared = SharedUnit::all(&records, &[1, 3], &scope(&[2, 4]));
        assert_eq!(shared.len(), 1);
        let joints: Vec<usize> = shared[0].joints.iter().map(|unit| unit.joint).collect();
        assert_eq!((joints, shared[0].n_total()), (vec![1, 3], 280));
        assert!(SharedUnit::all(&records, &[1, 3], &scope(&[8])).is_empty());
        records.remove(0);
        assert!(SharedUnit::all(&records, &[1, 3], &scope(&[2])).is_empty());
    }
}
