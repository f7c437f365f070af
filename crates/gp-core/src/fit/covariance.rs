//! Learning the hyperparameters of any covariance, from starts of the caller's choice.

use faer::MatRef;
use kernels::Covariance;

use crate::data::{require_noise, require_training_data};
use crate::error::GpError;
use crate::evidence::{LogMarginal, spread_rows, subset};
use crate::fit_posterior::FitPosterior;
use crate::search::{
    FitOptions, SearchEnd, SearchScheme, StartKind, StartReport, highest, no_usable_start, refine,
    search, search_near, stage_sizes,
};

/// A function of any covariance, learned.
#[derive(Debug, Clone)]
pub struct CovarianceFit<C> {
    /// The process with the hyperparameters found, conditioned on the data.
    pub posterior: FitPosterior<C>,
    /// The search on all samples that reached the highest likelihood.
    pub report: StartReport,
    /// Index of the start that it set out from.
    pub winner: usize,
    /// Starts that were compared.
    pub n_starts: usize,
    /// Likelihoods with gradient of all searches together.
    pub evaluations: usize,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// Bound on the error of the log marginal likelihood at the end, nats.
    pub error_bound: f64,
}

impl<C> CovarianceFit<C> {
    /// Log marginal likelihood at the end, natural log, summed over the data.
    pub fn log_marginal(&self) -> f64 {
        self.report.log_marginal
    }
}

/// Maximises eq. (8) over the hyperparameters of a covariance and σ, and conditions on the data.
///
/// Beyond 512 samples the starts are compared on a few of them and the highest goes on to more and
/// more, unless `options.scheme` asks for all samples from the beginning.
/// Sequential and deterministic; `options.starts` is not used.
/// # Shapes
/// `x` (n, d), rows as the covariance needs them; `targets` (n,); `starts` (covariance, σ).
/// # Errors
/// Fewer than 2 samples, data that is not finite or does not match, a σ that is not positive, or no
/// start with a finite likelihood.
/// # Panics
/// If `x` does not have the number of columns that a covariance needs.
/// # Source
/// Sec. 3 and A.1, for another covariance than eq. (7).
pub fn fit_covariance<C: Covariance + Clone>(
    x: MatRef<'_, f64>,
    targets: &[f64],
    starts: &[(C, f64)],
    options: &FitOptions,
) -> Result<CovarianceFit<C>, GpError> {
    require_training_data(x, targets, 2)?;
    for (_, noise_std) in starts {
        require_noise(*noise_std)?;
    }
    let n_samples = targets.len();
    let sizes = match options.scheme {
        SearchScheme::Whole => vec![n_samples],
        SearchScheme::Nested => stage_sizes(n_samples),
    };
    let (some_x, some_targets) = subset(x, targets, &spread_rows(n_samples, sizes[0]));
    let (winner, mut best, mut evaluations) =
        best_start(some_x.as_ref(), &some_targets, starts, options)?;
    for &n in &sizes[1..] {
        let (some_x, some_targets) = subset(x, targets, &spread_rows(n_samples, n));
        let mut evidence = LogMarginal::new(some_x.as_ref(), &some_targets, options.likelihood);
        let (covariance, noise_std) = (&best.covariance, best.noise_std);
        let kind = StartKind::Given;
        best = search_near(&mut evidence, covariance, noise_std, kind, options);
        evaluations += best.report.evaluations;
    }
    if !best.report.log_marginal.is_finite() {
        return Err(no_usable_start(&[best]));
    }
    let bounds_hit = best.bounds_hit();
    let (posterior, error_bound) = FitPosterior::with_error_bound(
        best.covariance,
        best.noise_std,
        x,
        targets,
        options.likelihood,
    )?;
    Ok(CovarianceFit {
        posterior,
        report: best.report,
        winner,
        n_starts: starts.len(),
        evaluations,
        bounds_hit,
        error_bound,
    })
}

/// The start whose search ends highest, the first of equals; its end; the evaluations of all.
fn best_start<C: Covariance + Clone>(
    x: MatRef<'_, f64>,
    targets: &[f64],
    starts: &[(C, f64)],
    options: &FitOptions,
) -> Result<(usize, SearchEnd<C>, usize), GpError> {
    let mut evidence = LogMarginal::new(x, targets, options.likelihood);
    let to_come_near = FitOptions {
        max_evaluations: options.max_evaluations.div_ceil(2),
        ..options.clone()
    };
    let mut ends: Vec<SearchEnd<C>> = (starts.iter())
        .map(|(covariance, noise_std)| {
            let kind = StartKind::Given;
            search(&mut evidence, covariance, *noise_std, kind, &to_come_near)
        })
        .collect();
    let mut evaluations = ends.iter().map(|end| end.report.evaluations).sum();
    let idx = highest(&ends).ok_or_else(|| no_usable_start(&ends))?;
    let mut end = ends.swap_remove(idx);
    let before = end.report.evaluations;
    refine(&mut evidence, &mut end, &to_come_near);
    evaluations += end.report.evaluations - before;
    Ok((idx, end, evaluations))
}
