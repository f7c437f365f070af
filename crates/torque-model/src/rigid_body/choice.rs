//! Which friction terms each joint keeps: the fewest that predict what is left out about as well as any.

use std::sync::Arc;

use puma_dyn::Model;
use rayon::prelude::*;

use crate::error::TorqueError;
use crate::rigid_body::correlation::{ENOUGH_ROWS, longest_lag};
use crate::rigid_body::fit::{FitSettings, fit_passes};
use crate::rigid_body::log::Log;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::term_set::TermSet;

/// How far from the best, in the mean logarithm of nMSE, a simpler set may be.
const TOLERANCE: f64 = 0.05;
/// What signs have to gain over everything smooth: friction that jumps shows by far more.
const GAIN_OF_SIGNS: f64 = 1.0;
/// Parts that are left out at most, one after another.
const MOST_FOLDS: usize = 24;
/// Parts that it takes to judge by them.
const FEWEST_FOLDS: usize = 2;
/// Runs from which whole runs are left out, and parts of the log where there are fewer.
const FEWEST_RUNS: usize = 3;
const BLOCKS: usize = 5;
/// Rows of a block that it takes to judge by it.
const BLOCK_ROWS: usize = 4;

/// How the friction terms of each joint were chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct TermChoice {
    /// Of each joint, (ℓ,).
    pub kept: Vec<TermSet>,
    /// Every set that was tried, with the mean of log nMSE over the parts left out for each joint, (ℓ,); `None` for a
    /// joint that too few parts can judge.
    pub scores: Vec<(TermSet, Vec<Option<f64>>)>,
    /// The same of the links as they are described, without friction, (ℓ,).
    pub described: Vec<Option<f64>>,
}

impl TermChoice {
    /// The mean of log nMSE with the set that a joint keeps, and that of the description alone.
    ///
    /// # Panics
    /// If there is no such joint.
    pub fn kept_and_described(&self, joint: usize) -> Option<(f64, f64)> {
        let kept = self
            .scores
            .iter()
            .find(|(set, _)| *set == self.kept[joint])?;
        kept.1[joint].zip(self.described[joint])
    }
}

/// log nMSE on rows that were left out.
#[derive(Debug, Clone, Copy)]
struct LogErrors {
    learned: f64,
    described: f64,
}

/// Rows to learn from, and rows to judge by.
struct Fold<'a> {
    kept: Log<'a>,
    held: Log<'a>,
    fewest_rows: usize,
}

/// Chooses each joint's friction terms by leaving out one run after another, or blocks in time where there
/// are fewer than three runs, or one for each load.
///
/// ```text
/// score = mean over parts left out of log(mean (y − ŷ)²/var y),  on rows that count, where there are 50 (4 of a block)
/// ```
/// The first of tanh, minimal, standard and full within 0.05 of the least; signs where they are better than all of these
/// by more than 1. A joint that fewer than two parts can judge keeps the minimal set, or tanh where nothing says how
/// the joint moved before.
/// # Errors
/// As for a fit.
pub(crate) fn choose_terms(
    robot: &Arc<Model>,
    described: &[f64],
    log: &Log<'_>,
    settings: &FitSettings,
) -> Result<TermChoice, TorqueError> {
    let has_memory = log.require_memory(&[5e-4]).is_ok();
    let has_all_memory = log.require_memory(&[5e-4, 2e-3]).is_ok();
    let can_be = |set: &TermSet| match set {
        TermSet::Tanh | TermSet::Signs => true,
        TermSet::Minimal | TermSet::Standard => has_memory,
        TermSet::Full => has_all_memory,
    };
    let candidates: Vec<TermSet> = TermSet::ALL.into_iter().filter(can_be).collect();
    let folds = folds(log, settings);
    let n_joints = robot.n_joints();
    let tasks: Vec<(TermSet, &Fold<'_>)> = (candidates.iter())
        .flat_map(|set| folds.iter().map(|fold| (*set, fold)))
        .collect();
    let errors: Vec<Result<Vec<Option<LogErrors>>, TorqueError>> = (tasks.par_iter())
        .map(|(set, fold)| {
            let sets = vec![*set; n_joints];
            let fitted = fit_passes(robot, described, &fold.kept, &sets, settings)?.into_last()?;
            errors_of(&fitted, &fold.held, fold.fewest_rows)
        })
        .collect();
    let errors: Vec<Vec<Option<LogErrors>>> = errors.into_iter().collect::<Result<_, _>>()?;
    let n_folds = folds.len();
    let scores: Vec<(TermSet, Vec<Option<f64>>)> = (candidates.iter().enumerate())
        .map(|(number, set)| {
            let of_set = &errors[number * n_folds..(number + 1) * n_folds];
            (
                *set,
                (0..n_joints)
                    .map(|joint| mean_of(of_set, joint, |errors| errors.learned))
                    .collect(),
            )
        })
        .collect();
    let plain = if has_memory {
        TermSet::Minimal
    } else {
        TermSet::Tanh
    };
    let kept = (0..n_joints)
        .map(|joint| best(&scores, joint).unwrap_or(plain))
        .collect();
    // The description is the same whatever is learned.
    let of_any = &errors[..n_folds.min(errors.len())];
    let described = (0..n_joints)
        .map(|joint| mean_of(of_any, joint, |errors| errors.described))
        .collect();
    Ok(TermChoice {
        kept,
        scores,
        described,
    })
}

/// The mean over the parts that can judge a joint, of which there must be two.
fn mean_of(
    errors: &[Vec<Option<LogErrors>>],
    joint: usize,
    of: impl Fn(LogErrors) -> f64,
) -> Option<f64> {
    let judged: Vec<f64> = errors
        .iter()
        .filter_map(|of_joint| of_joint[joint].map(&of))
        .collect();
    (judged.len() >= FEWEST_FOLDS).then(|| judged.iter().sum::<f64>() / judged.len() as f64)
}

fn best(scores: &[(TermSet, Vec<Option<f64>>)], joint: usize) -> Option<TermSet> {
    let score = |of: &(TermSet, Vec<Option<f64>>)| of.1[joint];
    let smooth: Vec<_> = scores
        .iter()
        .filter(|(set, _)| *set != TermSet::Signs)
        .collect();
    let least = smooth.iter().filter_map(|of| score(of)).reduce(f64::min)?;
    let signs = scores.iter().find(|(set, _)| *set == TermSet::Signs);
    if signs
        .and_then(score)
        .is_some_and(|signs| signs < least - GAIN_OF_SIGNS)
    {
        return Some(TermSet::Signs);
    }
    let is_near = |of: &&&(TermSet, Vec<Option<f64>>)| {
        score(of).is_some_and(|score| score <= least + TOLERANCE)
    };
    smooth.iter().find(is_near).map(|(set, _)| *set)
}

/// log nMSE of each joint on the rows that count of a log; `None` of too few.
fn errors_of(
    posterior: &ParameterPosterior,
    log: &Log<'_>,
    fewest: usize,
) -> Result<Vec<Option<LogErrors>>, TorqueError> {
    #[derive(Default, Clone)]
    struct Moments {
        n: f64,
        square_error: f64,
        square_target: f64,
        torques: Vec<f64>,
    }
    let design = posterior.design(log)?;
    let mut moments = vec![Moments::default(); posterior.unknowns().n_joints()];
    design.for_each(&mut moments, |of, joint, panel| {
        if !design.is_seen(joint) {
            return;
        }
        let (rows, load) = (
            &panel.joints[joint],
            posterior.load_of(log.runs[panel.run].context),
        );
        let rigid = design.rigid(joint, rows, posterior.mean(), load);
        let residuals = design.residuals(joint, rows, posterior.mean(), load, Some(&rigid));
        of.n += residuals.len() as f64;
        of.square_error += residuals.iter().map(|e| e * e).sum::<f64>();
        of.square_target += rows.targets.iter().map(|e| e * e).sum::<f64>();
        let torques = rows.targets.iter().zip(&rows.described);
        of.torques
            .extend(torques.map(|(target, known)| target + known));
    });
    let error = |of: &Moments| {
        let centre = of.torques.iter().sum::<f64>() / of.n;
        let var = of.torques.iter().map(|t| (t - centre).powi(2)).sum::<f64>();
        let learned = (of.square_error / var).ln();
        let described = (of.square_target / var).ln();
        (of.torques.len() >= fewest && var > 0.0 && learned.is_finite())
            .then_some(LogErrors { learned, described })
    };
    Ok(moments.iter().map(error).collect())
}

fn folds<'a>(log: &Log<'a>, settings: &FitSettings) -> Vec<Fold<'a>> {
    if log.runs.len() < FEWEST_RUNS {
        return blocks(log);
    }
    let per_fold = log.runs.len().div_ceil(MOST_FOLDS);
    let n_folds = log.runs.len().div_ceil(per_fold);
    let all: Vec<usize> = (0..log.runs.len()).collect();
    // Runs of one load often follow one another: dealt out, no part takes all of them.
    let fold = |number: usize| {
        let held: Vec<usize> = all.iter().copied().skip(number).step_by(n_folds).collect();
        let kept: Vec<usize> = all
            .iter()
            .copied()
            .filter(|run| !held.contains(run))
            .collect();
        // A load that nothing is left of cannot be predicted.
        let can_judge = |run: &usize| {
            let context = log.runs[*run].context;
            let name = log.samples.contexts.get(context);
            let is_bare = name.is_some_and(|name| settings.bare.contains(name));
            is_bare || kept.iter().any(|other| log.runs[*other].context == context)
        };
        let held: Vec<usize> = held.iter().copied().filter(can_judge).collect();
        (!held.is_empty()).then(|| Fold {
            kept: log.of_runs(&kept),
            held: log.of_runs(&held),
            fewest_rows: ENOUGH_ROWS,
        })
    };
    let folds: Vec<Fold<'_>> = (0..n_folds).filter_map(fold).collect();
    // One run for each load: nothing is left of a load whose run is left out.
    if folds.len() < FEWEST_FOLDS {
        blocks(log)
    } else {
        folds
    }
}

/// Blocks of neighbouring rows, with as many rows left out beside them as are correlated with theirs.
///
/// The runs stay whole, so that friction remembers what was before a block; what changes is which rows count.
fn blocks<'a>(log: &Log<'a>) -> Vec<Fold<'a>> {
    let n_blocks = BLOCKS.div_ceil(log.runs.len().max(1)).max(2);
    let of_run = |run: usize| {
        let (rows, step) = (log.runs[run].span.clone(), log.runs[run].step);
        let length = rows.len().div_ceil(n_blocks).max(1);
        let lags = longest_lag(step);
        let gap = lags.min(length / 2);
        (0..n_blocks).map(move |block| {
            let start = (rows.start + block * length).min(rows.end);
            let end = (start + length).min(rows.end);
            let near = start.saturating_sub(gap).max(rows.start)..(end + gap).min(rows.end);
            Fold {
                kept: log.counting(|place| !near.contains(&place)),
                held: log.counting(|place| (start..end).contains(&place)),
                fewest_rows: BLOCK_ROWS,
            }
        })
    };
    (0..log.runs.len()).flat_map(of_run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scores(values: &[(TermSet, f64)]) -> Vec<(TermSet, Vec<Option<f64>>)> {
        values
            .iter()
            .map(|(set, value)| (*set, vec![Some(*value)]))
            .collect()
    }

    #[test]
    fn the_simplest_of_those_near_the_best_is_kept() {
        use TermSet::{Full, Minimal, Signs, Standard, Tanh};
        let near = scores(&[
            (Tanh, -1.0),
            (Minimal, -2.0),
            (Standard, -2.04),
            (Full, -2.01),
        ]);
        assert_eq!(best(&near, 0), Some(Minimal));
        let far = scores(&[
            (Tanh, -1.0),
            (Minimal, -1.9),
            (Standard, -2.04),
            (Signs, -3.0),
        ]);
        assert_eq!(best(&far, 0), Some(Standard));
        let jumps = scores(&[(Tanh, -1.0), (Minimal, -1.9), (Signs, -3.0)]);
        assert_eq!(best(&jumps, 0), Some(Signs));
        assert_eq!(best(&[(Tanh, vec![None])], 0), None);
    }
}
