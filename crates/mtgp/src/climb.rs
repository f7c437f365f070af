//! A search from several starts for the price of little more than one.
//!
//! Every start gets some evaluations; the one that is highest then goes on to the end.

use gp_core::{Curvature, FitOptions, Likelihood, SearchEnd, StartKind, StopReason, search_near};
use kernels::Covariance;

use crate::task_fit::{MultiTaskOptions, Origin, TaskStart};

/// Evaluations after which the coordinates of a search are renewed.
const ROUND: usize = 150;

/// Nats that a round must gain for another to follow, once the search has stalled.
const WORTH_A_ROUND: f64 = 0.01;

/// Hyperparameters from which a search sets out, and where they are from.
pub(crate) struct Start<C> {
    pub origin: Origin,
    pub covariance: C,
    pub noise_std: f64,
    /// What is known of the curvature of the likelihood there.
    pub curvature: Curvature,
}

/// Where the searches from several starts ended.
pub(crate) struct Climb<C> {
    /// The end of the winner.
    pub covariance: C,
    pub noise_std: f64,
    pub curvature: Curvature,
    pub bounds_hit: Vec<String>,
    pub starts: Vec<TaskStart>,
    pub winner: usize,
}

impl<C> Climb<C> {
    /// The same climb, with the covariance as part of another.
    pub fn map<D>(self, whole: impl FnOnce(C) -> D) -> Climb<D> {
        Climb {
            covariance: whole(self.covariance),
            noise_std: self.noise_std,
            curvature: self.curvature,
            bounds_hit: self.bounds_hit,
            starts: self.starts,
            winner: self.winner,
        }
    }
}

/// Climbs the likelihood from all starts; `None` if none of them has one.
///
/// The likelihood at the end is at least the highest of those at the starts.
pub(crate) fn climb<C: Covariance + Clone>(
    likelihood: &mut impl Likelihood<C>,
    starts: Vec<Start<C>>,
    options: &MultiTaskOptions,
) -> Option<Climb<C>> {
    let first_part = if starts.len() == 1 {
        options.max_evaluations
    } else {
        options.screening.min(options.max_evaluations)
    };
    let origins: Vec<Origin> = starts.iter().map(|start| start.origin).collect();
    let mut ends: Vec<SearchEnd<C>> = (starts.into_iter())
        .map(|start| {
            let search_options = search_options(options, first_part);
            let point = (&start.covariance, start.noise_std);
            let kind = kind_of(start.origin);
            search_near(likelihood, point, kind, &search_options, start.curvature)
        })
        .collect();

    let winner = highest(&ends)?;
    finish(likelihood, &mut ends[winner], options);
    let reports: Vec<TaskStart> = (origins.into_iter().zip(&ends))
        .map(|(origin, end)| TaskStart {
            origin,
            report: end.report.clone(),
        })
        .collect();
    let end = ends.swap_remove(winner);
    Some(Climb {
        bounds_hit: end.bounds_hit(),
        covariance: end.covariance,
        noise_std: end.noise_std,
        curvature: end.curvature,
        starts: reports,
        winner,
    })
}

/// Goes on from where a search ended, as long as there are evaluations left and it gains.
///
/// Each round sets out with the curvature that the rounds before have learned, in whose
/// coordinates a search that had come to a crawl makes long steps again.
fn finish<C: Covariance + Clone>(
    likelihood: &mut impl Likelihood<C>,
    end: &mut SearchEnd<C>,
    options: &MultiTaskOptions,
) {
    while end.report.stop != StopReason::GradientSmall {
        let left = (options.max_evaluations).saturating_sub(end.report.evaluations);
        if left == 0 {
            return;
        }
        let search_options = search_options(options, left.min(ROUND));
        let point = (&end.covariance, end.noise_std);
        let curvature = end.curvature.clone();
        let kind = end.report.kind;
        let mut last = search_near(likelihood, point, kind, &search_options, curvature);
        last.report.initial_log_marginal = end.report.initial_log_marginal;
        last.report.evaluations += end.report.evaluations;
        last.report.iterations += end.report.iterations;
        last.report.recoveries += end.report.recoveries;
        last.report.work += end.report.work;
        let gain = last.report.log_marginal - end.report.log_marginal;
        // The pivots of the low-rank path depend on what came before, and with them
        // the last digits of a likelihood.
        if gain < 0.0 {
            end.report.evaluations = last.report.evaluations;
            return;
        }
        *end = last;
        let is_stalled = end.report.stop != StopReason::EvaluationLimit;
        if is_stalled && gain < WORTH_A_ROUND {
            return;
        }
    }
}

fn search_options(options: &MultiTaskOptions, max_evaluations: usize) -> FitOptions {
    FitOptions {
        max_evaluations,
        gradient_tolerance: options.gradient_tolerance,
        value_tolerance: options.value_tolerance,
        likelihood: options.likelihood,
        ..FitOptions::chapter()
    }
}

fn kind_of(origin: Origin) -> StartKind {
    match origin {
        Origin::Moments(kind) => kind,
        _ => StartKind::Given,
    }
}

/// Index of the highest finite likelihood; the earliest of equals.
fn highest<C>(ends: &[SearchEnd<C>]) -> Option<usize> {
    let value = |idx: usize| ends[idx].report.log_marginal;
    (0..ends.len())
        .filter(|&idx| value(idx).is_finite())
        .reduce(|best, idx| if value(idx) > value(best) { idx } else { best })
}
