//! One curve from data to record: fit every learner at every place, predict the target, score.

use mtgp::fit::fit_rank_from;
use mtgp::{MultiTaskOptions, StageOne, TaskFit, fit_ranks};

use super::curve::{Axis, Curve, CurveRecord, Learner, Score};
use crate::cell::ModelKind;
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::models::Fitted;
use crate::multi::draw::nested;
use crate::section5::trained::RANK;
use crate::section5::training_set::{SPLIT_SEED, Samples};
use crate::seed::{sample_indices, stream};
use crate::split::{Split, UNIQUE};

/// Seed of the other loads and of all samples.
const SEED: &str = "transfer";

/// Evaluations of a search that sets out from the fit to fewer samples.
const MAX_REFINEMENT: usize = 150;

/// Fits and scores all places of a curve; sequential, and the same bits on every call.
///
/// # Errors
/// `Experiment` for a curve that cannot be measured; `Fit` or `MultiTask` if a model cannot be
/// fitted; the errors of [`nmse`].
/// # Source
/// Section 4.6 for the models; A.3 for the fits.
pub fn measure(curve: &Curve, data: &DataSet) -> Result<CurveRecord, BenchError> {
    curve.require_possible()?;
    let mut scores = Vec::new();
    let mut before: Option<TaskFit> = None;
    for &count in &curve.counts {
        let place = Place::new(curve, count, data)?;
        let alone = place.alone()?;
        scores.push(alone);
        if place.samples.loads.len() == 1 {
            let others = Learner::ALL.into_iter().skip(1);
            scores.extend(others.map(|learner| Score { learner, ..alone }));
            continue;
        }
        let warm = before.take().filter(|_| curve.axis == Axis::Samples);
        let (stage_one, transfer) = place.together(warm.as_ref())?;
        scores.push(place.score(Learner::Independent, &stage_one.independent)?);
        scores.push(place.score(Learner::Pooled, &stage_one.pooled)?);
        scores.push(place.score(Learner::Transfer, &transfer)?);
        before = Some(transfer);
    }
    Ok(CurveRecord {
        curve: curve.clone(),
        scores,
    })
}

/// One place on a curve: what is known there, and what is predicted.
struct Place<'a> {
    curve: &'a Curve,
    count: usize,
    data: &'a DataSet,
    /// The target first.
    samples: Samples,
    /// Rows of the target that are predicted.
    test: Vec<usize>,
}

impl<'a> Place<'a> {
    fn new(curve: &'a Curve, count: usize, data: &'a DataSet) -> Result<Self, BenchError> {
        let (n_others, n_target) = curve.sizes(count);
        let mut loads = vec![curve.target];
        loads.extend(other_loads(curve.target, n_others));
        let rows = loads.iter().map(|&load| {
            let n = if load == curve.target {
                n_target
            } else {
                curve.n_each
            };
            nested(&Split::draw(SPLIT_SEED, load), SEED, load, 0, n)
        });
        let rows = rows.collect();
        let extrap = Split::draw(SPLIT_SEED, curve.target).extrap;
        Ok(Self {
            curve,
            count,
            data,
            samples: Samples::of(data, loads, rows)?,
            test: extrap.into_iter().step_by(curve.test_stride).collect(),
        })
    }

    /// sGP.
    fn alone(&self) -> Result<Score, BenchError> {
        let rows = &self.samples.rows[0];
        let torques = self.torques(rows);
        let x = self.data.x(rows);
        let fitted = Fitted::fit(ModelKind::GpCoulomb, x.as_ref(), &torques)?;
        let means = fitted.predict_mean(self.data.x(&self.test).as_ref())?;
        let summary = fitted.summary().expect("GPc has hyperparameters");
        Ok(Score {
            learner: Learner::Single,
            count: self.count,
            nmse: nmse(&means, &self.torques(&self.test))?,
            log_marginal_likelihood: summary.log_marginal_likelihood,
            evaluations: summary.evaluations,
        })
    }

    /// iGP and pGP, and the mGP: refined from a fit to fewer samples of the same loads if there is one.
    fn together(&self, warm: Option<&TaskFit>) -> Result<(StageOne, TaskFit), BenchError> {
        let stacked = &self.samples.stacked;
        let targets = self.samples.targets(self.data, self.curve.joint);
        let options = MultiTaskOptions::several();
        let stage_one = StageOne::new(stacked, &targets, &options)?;
        let rank = RANK.min(stacked.n_tasks());
        let Some(warm) = warm else {
            let fits = fit_ranks(stacked, &targets, &[rank], &stage_one, &options)?;
            let fit = fits.into_iter().next().expect("one fit a rank");
            return Ok((stage_one, fit));
        };
        let options = MultiTaskOptions {
            max_evaluations: MAX_REFINEMENT,
            ..options
        };
        let fit = fit_rank_from(stacked, &targets, rank, &stage_one, &[warm], &options)?;
        Ok((stage_one, fit))
    }

    fn score(&self, learner: Learner, fit: &TaskFit) -> Result<Score, BenchError> {
        let means = fit.predict_mean(0, self.data.x(&self.test).as_ref())?;
        Ok(Score {
            learner,
            count: self.count,
            nmse: nmse(&means, &self.torques(&self.test))?,
            log_marginal_likelihood: fit.log_marginal(),
            evaluations: fit.report.evaluations(),
        })
    }

    /// The target's torques, N·m.
    fn torques(&self, rows: &[usize]) -> Vec<f64> {
        self.data.torques(self.curve.target, self.curve.joint, rows)
    }
}

/// The first `n` other loads, in a random order of the target's own that does not depend on `n`.
fn other_loads(target: usize, n: usize) -> Vec<usize> {
    let all: Vec<usize> = (1..=UNIQUE.len()).filter(|&load| load != target).collect();
    let mut rng = stream(SEED, &format!("others/c{target}"));
    let drawn = sample_indices(&mut rng, all.len(), n);
    drawn.into_iter().map(|i| all[i]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_loads_are_nested_and_never_the_target() {
        for target in [1, 8, 15] {
            let all = other_loads(target, 14);
            for n in [0, 1, 2, 4, 7, 13] {
                assert_eq!(other_loads(target, n), all[..n]);
            }
            let mut sorted = all;
            sorted.push(target);
            sorted.sort_unstable();
            assert_eq!(sorted, (1..=15).collect::<Vec<_>>());
        }
        assert_ne!(other_loads(1, 4), other_loads(2, 4));
    }

    #[test]
    fn curves_that_cannot_be_measured_are_refused() {
        let curve = |axis, counts: &[usize]| Curve {
            axis,
            target: 3,
            joint: 6,
            counts: counts.to_vec(),
            n_each: 5,
            test_stride: 100,
        };
        assert!(curve(Axis::Others, &[0, 14]).require_possible().is_ok());
        for (axis, counts) in [
            (Axis::Others, [1, 15]),
            (Axis::Samples, [1, 5]),
            (Axis::Samples, [5, 4001]),
        ] {
            let error = curve(axis, &counts).require_possible().unwrap_err();
            assert!(error.to_string().contains("is not possible"), "{error}");
        }
        let other = Curve {
            target: 16,
            ..curve(Axis::Others, &[1])
        };
        let error = other.require_possible().unwrap_err().to_string();
        assert!(error.ends_with("there is no load c16"), "{error}");
    }
}
