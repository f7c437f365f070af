//! Learning the hyperparameters of one joint's torque by maximum marginal likelihood.

use faer::MatRef;
use kernels::{TorqueCovariance, TorqueForm};

use super::chapter_start::{chapter_start, varied_start};
use crate::data::{joints_of, require_training_data};
use crate::error::GpError;
use crate::evidence::{LogMarginal, spread_rows, subset};
use crate::fit_posterior::FitPosterior;
use crate::search::{
    Candidate, FitOptions, FitReport, SearchEnd, SearchScheme, StageReport, StartPoint,
    StartReport, highest, no_usable_start, refine, search_on, stage_sizes,
};

/// Floating-point operations that each stage of a nested search may take.
const STAGE_FLOPS: f64 = 4e10;

/// Dense likelihoods that each stage may compute, however many samples there are.
const MIN_WORK: f64 = 2.0;

/// Factor of the value tolerance on subsets of the samples.
const LOOSER: f64 = 10.0;

/// The starts set out once more on the largest subset of at most so many samples,
/// and on all samples, as long as the stage has work left.
///
/// What 250 samples call superfluous, 1000 may need: measured, starts on 1000 end
/// up to 20 nats higher.
const ALL_STARTS_UP_TO: usize = 1024;

/// Dense likelihoods' worth of work for the starts on all of more samples than that:
/// enough where the rank is a few dozen.
const STARTS_WORK: f64 = 1.0;

/// A joint's torque, learned.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The process with the hyperparameters found, conditioned on the data.
    pub posterior: FitPosterior,
    /// How the hyperparameters were found.
    pub report: FitReport,
}

impl Fit {
    /// The covariance with the hyperparameters found.
    pub fn covariance(&self) -> &TorqueCovariance {
        self.posterior.covariance()
    }

    /// The noise standard deviation found, in target units.
    pub fn noise_std(&self) -> f64 {
        self.posterior.noise_std()
    }
}

/// Learns a joint's torque from data, without (GP¬c) or with (GPc) friction.
///
/// Maximises eq. (8) over the hyperparameters under σ² ≥ 10⁻⁴ and u ≤ 100, from
/// each start in turn, and keeps the highest likelihood.
/// Sequential and deterministic.
/// # Shapes
/// `x` (n, 3ℓ) with columns (q, q̇, q̈) in rad, rad/s, rad/s²; `targets` (n,), N·m.
/// # Errors
/// Fewer than 2 samples, data that is not finite (with its row and column) or
/// does not match, columns that are not three per joint, or no start with a
/// finite likelihood.
/// # Source
/// Sec. 3 and A.1.
pub fn fit(
    x: MatRef<'_, f64>,
    targets: &[f64],
    form: TorqueForm,
    options: &FitOptions,
) -> Result<Fit, GpError> {
    let chapter = chapter_start(x, targets, form)?;
    let starts = (options.starts.kinds().iter())
        .map(|kind| varied_start(&chapter, *kind))
        .collect::<Result<Vec<_>, _>>()?;
    fit_from(x, targets, &starts, options)
}

/// Learns a joint's torque from starts of the caller's choice, such as a fit to fewer data.
///
/// `options.starts` is not used.
/// # Errors
/// As for [`fit`]; also [`GpError::WrongCovariates`] for a start of another robot.
pub fn fit_from(
    x: MatRef<'_, f64>,
    targets: &[f64],
    starts: &[StartPoint],
    options: &FitOptions,
) -> Result<Fit, GpError> {
    require_training_data(x, targets, 2)?;
    let n_joints = joints_of(x)?;
    if let Some(other) = starts.iter().find(|s| s.covariance.n_joints() != n_joints) {
        return Err(GpError::WrongCovariates {
            found: x.ncols(),
            expected: 3 * other.covariance.n_joints(),
        });
    }

    let first: Vec<Candidate> = starts.iter().map(Candidate::of).collect();
    let mut stages = Vec::new();
    let candidates = before_the_last(x, targets, &first, options, &mut stages);
    let ends = climb(x, targets, &candidates, &first, options);
    stages.push(stage_report(targets.len(), &ends));
    let winner = highest(&ends).ok_or_else(|| no_usable_start(&ends))?;

    let end = &ends[winner];
    let (posterior, error_bound) = FitPosterior::with_error_bound(
        end.covariance.clone(),
        end.noise_std,
        x,
        targets,
        options.likelihood,
    )?;
    let report = FitReport {
        log_marginal: end.report.log_marginal,
        winner,
        bounds_hit: end.bounds_hit(),
        jitter_added: 0.0,
        method: posterior.method(),
        rank: posterior.rank(),
        error_bound,
        condition_lower_bound: posterior.condition_lower_bound(),
        seconds: None,
        stages,
    };
    Ok(Fit { posterior, report })
}

/// The searches on subsets; returns the candidates for all samples.
fn before_the_last(
    x: MatRef<'_, f64>,
    targets: &[f64],
    first: &[Candidate],
    options: &FitOptions,
    stages: &mut Vec<StageReport>,
) -> Vec<Candidate> {
    let mut candidates = first.to_vec();
    if options.scheme == SearchScheme::Whole || first.is_empty() {
        return candidates;
    }
    let n_samples = targets.len();
    let loose = FitOptions {
        value_tolerance: LOOSER * options.value_tolerance,
        ..options.clone()
    };
    let sizes = stage_sizes(n_samples);
    let all_starts_at = (sizes.iter().copied()).rfind(|&n| n <= ALL_STARTS_UP_TO);
    for pair in sizes.windows(2) {
        let (n, next) = (pair[0], pair[1]);
        let (some_x, some_targets) = subset(x, targets, &spread_rows(n_samples, n));
        let ends = climb(some_x.as_ref(), &some_targets, &candidates, first, &loose);
        stages.push(stage_report(n, &ends));
        let best = highest(&ends).map(|best| Candidate::heir(&ends[best]));
        candidates = best.into_iter().collect();
        if Some(next) == all_starts_at {
            candidates.extend_from_slice(first);
        } else if next == n_samples {
            // The later ones have longer length scales, so a lower rank and less work.
            candidates.extend(first.iter().rev().cloned());
        }
    }
    candidates
}

/// The searches of one stage; from the first starts if no candidate has a likelihood on these samples.
fn climb(
    x: MatRef<'_, f64>,
    targets: &[f64],
    candidates: &[Candidate],
    first: &[Candidate],
    options: &FitOptions,
) -> Vec<SearchEnd<TorqueCovariance>> {
    // Its matrices are as large as those of the posterior to come, so it ends here.
    let mut evidence = LogMarginal::new(x, targets, options.likelihood);
    let mut ends = climb_from(&mut evidence, candidates, options);
    if highest(&ends).is_none() && candidates.iter().any(|candidate| candidate.is_heir) {
        ends.extend(climb_from(&mut evidence, first, options));
    }
    ends
}

/// Searches from each candidate in turn, as long as there is work left for the stage.
fn climb_from(
    evidence: &mut LogMarginal<'_>,
    candidates: &[Candidate],
    options: &FitOptions,
) -> Vec<SearchEnd<TorqueCovariance>> {
    let n_samples = evidence.x().nrows();
    let mut left = match options.scheme {
        SearchScheme::Whole => f64::INFINITY,
        SearchScheme::Nested => stage_work(n_samples),
    };
    let n_heirs = candidates.iter().filter(|c| c.is_heir).count();
    let mut ends: Vec<SearchEnd<TorqueCovariance>> = Vec::new();
    for candidate in candidates {
        if ends.len() == n_heirs {
            left = left.min(stage_work_of_starts(n_samples, options.scheme));
        }
        if left <= 0.0 && highest(&ends).is_some() {
            break;
        }
        let options = FitOptions {
            max_evaluations: options.max_evaluations.div_ceil(2),
            max_work: options
                .max_work
                .min(if left > 0.0 { left } else { MIN_WORK }),
            ..options.clone()
        };
        let end = search_on(evidence, candidate, &options);
        left -= end.report.work;
        ends.push(end);
    }
    // An heir is refined from its beginning.
    if let Some(best) = highest(&ends).filter(|&best| !candidates[best].is_heir) {
        refine_best(evidence, &mut ends[best], options, left);
    }
    ends
}

/// Gives the highest end the evaluations and the work that are left.
fn refine_best(
    evidence: &mut LogMarginal<'_>,
    best: &mut SearchEnd<TorqueCovariance>,
    options: &FitOptions,
    left: f64,
) {
    let StartReport {
        evaluations, work, ..
    } = best.report;
    let of_refinement = FitOptions {
        max_evaluations: options.max_evaluations.saturating_sub(evaluations),
        max_work: left.min(options.max_work - work),
        ..options.clone()
    };
    refine(evidence, best, &of_refinement);
}

/// Work that the searches of one stage may take together, in likelihoods by the dense path.
///
/// ```text
/// max(2, 4·10¹⁰/n³)
/// ```
/// Low-rank likelihoods are so small a part of a dense one that it does not limit them.
fn stage_work(n_samples: usize) -> f64 {
    (STAGE_FLOPS / (n_samples as f64).powi(3)).max(MIN_WORK)
}

/// The part of it that searches from the first starts may take after others.
fn stage_work_of_starts(n_samples: usize, scheme: SearchScheme) -> f64 {
    match scheme {
        SearchScheme::Nested if n_samples > ALL_STARTS_UP_TO => STARTS_WORK,
        _ => f64::INFINITY,
    }
}

fn stage_report(n_samples: usize, ends: &[SearchEnd<TorqueCovariance>]) -> StageReport {
    StageReport {
        n_samples,
        starts: ends.iter().map(|end| end.report.clone()).collect(),
    }
}
