//! A search from several starts for the price of little more than one.
//!
//! Every start gets some evaluations; the one that is highest then goes on to the end.

use gp_core::{
    FitOptions, GpError, Likelihood, SearchEnd, StartKind, highest, no_usable_start, refine,
    search, search_near,
};
use kernels::Covariance;

use super::options::{MultiTaskOptions, Origin, TaskStart};

/// Hyperparameters from which a search sets out, and where they are from.
#[derive(Clone)]
pub(crate) struct Start<C> {
    pub origin: Origin,
    pub covariance: C,
    pub noise_std: f64,
    /// Whether it is the end of another search, which the metric of the Fisher information suits.
    pub is_near: bool,
}

/// Where the searches from several starts ended.
pub(crate) struct Climb<C> {
    /// The end of the winner.
    pub covariance: C,
    pub noise_std: f64,
    pub bounds_hit: Vec<String>,
    pub starts: Vec<TaskStart>,
    pub winner: usize,
}

impl<C> Climb<C> {
    /// Where a search on more data may set out.
    pub fn into_start(mut self) -> Start<C> {
        Start {
            origin: self.starts.swap_remove(self.winner).origin,
            covariance: self.covariance,
            noise_std: self.noise_std,
            is_near: true,
        }
    }

    /// The same climb, with the covariance as part of another.
    pub fn map<D>(self, whole: impl FnOnce(C) -> D) -> Climb<D> {
        Climb {
            covariance: whole(self.covariance),
            noise_std: self.noise_std,
            bounds_hit: self.bounds_hit,
            starts: self.starts,
            winner: self.winner,
        }
    }
}

/// Climbs the likelihood from all starts.
///
/// The likelihood at the end is at least the highest of those at the starts.
/// # Errors
/// [`GpError::NoUsableStart`] if no start has a likelihood.
pub(crate) fn climb<C: Covariance + Clone>(
    likelihood: &mut impl Likelihood<C>,
    starts: Vec<Start<C>>,
    options: &MultiTaskOptions,
) -> Result<Climb<C>, GpError> {
    let first_part = options.screening.min(options.max_evaluations);
    let origins: Vec<Origin> = starts.iter().map(|start| start.origin).collect();
    let first = search_options(options, first_part);
    let mut ends: Vec<SearchEnd<C>> = (starts.into_iter())
        .map(|start| set_out(likelihood, &start, &first))
        .collect();

    let winner = highest(&ends).ok_or_else(|| no_usable_start(&ends))?;
    let used = ends[winner].report.evaluations;
    let left = options.max_evaluations.saturating_sub(used);
    refine(
        likelihood,
        &mut ends[winner],
        &search_options(options, left),
    );
    let reports: Vec<TaskStart> = (origins.into_iter().zip(&ends))
        .map(|(origin, end)| TaskStart {
            origin,
            report: end.report.clone(),
        })
        .collect();
    let end = ends.swap_remove(winner);
    Ok(Climb {
        bounds_hit: end.bounds_hit(),
        covariance: end.covariance,
        noise_std: end.noise_std,
        starts: reports,
        winner,
    })
}

/// The first part of the search from one start.
fn set_out<C: Covariance + Clone>(
    likelihood: &mut impl Likelihood<C>,
    start: &Start<C>,
    options: &FitOptions,
) -> SearchEnd<C> {
    let (kind, noise_std) = (kind_of(start.origin), start.noise_std);
    let climb = if start.is_near { search_near } else { search };
    climb(likelihood, &start.covariance, noise_std, kind, options)
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
