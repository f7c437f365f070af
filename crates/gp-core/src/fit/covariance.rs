//! Learning the hyperparameters of any covariance, from starts of the caller's choice.

use faer::{Mat, MatRef};
use kernels::{Covariance, TorqueCovariance};

use crate::data::{require_noise, require_training_data};
use crate::error::GpError;
use crate::evidence::{LikelihoodOptions, LogMarginal, spread_rows, subset};
use crate::posterior::Posterior;
use crate::search::{FitOptions, FitReport, Found, Plan, Start, climb};

/// A function of some covariance, learned; a joint's torque by default.
#[derive(Debug, Clone)]
pub struct Fit<C = TorqueCovariance> {
    /// The process with the hyperparameters found, conditioned on the data.
    pub posterior: Posterior<C>,
    /// How the hyperparameters were found.
    pub report: FitReport,
}

impl<C: Covariance> Fit<C> {
    /// The covariance with the hyperparameters found.
    pub fn covariance(&self) -> &C {
        self.posterior.covariance()
    }

    /// The noise standard deviation found, in target units.
    pub fn noise_std(&self) -> f64 {
        self.posterior.noise_std()
    }

    /// Log marginal likelihood, natural log, summed over the data.
    pub fn log_marginal(&self) -> f64 {
        self.report.log_marginal
    }

    /// Conditions on the data with the hyperparameters that a search found.
    ///
    /// # Errors
    /// As for [`Posterior::new`].
    /// # Panics
    /// If `x` does not have the number of columns that the covariance needs.
    pub fn new(
        found: Found<C>,
        x: MatRef<'_, f64>,
        targets: &[f64],
        likelihood: LikelihoodOptions,
    ) -> Result<Self, GpError> {
        let (covariance, noise_std) = (found.covariance, found.noise_std);
        let (posterior, error_bound) =
            Posterior::with_error_bound(covariance, noise_std, x, targets, likelihood)?;
        let report = FitReport {
            log_marginal: found.log_marginal,
            winner: found.winner,
            bounds_hit: found.bounds_hit,
            jitter_added: 0.0,
            method: posterior.method(),
            rank: posterior.rank(),
            error_bound,
            condition_lower_bound: posterior.condition_lower_bound(),
            seconds: None,
            stages: found.stages,
        };
        Ok(Self { posterior, report })
    }
}

impl<C: Covariance + Clone> Fit<C> {
    /// Climbs eq. (8) as a plan says, and conditions on all samples.
    pub(super) fn climb(
        x: MatRef<'_, f64>,
        targets: &[f64],
        starts: &[Start<C>],
        plan: &Plan,
        likelihood: LikelihoodOptions,
    ) -> Result<Self, GpError> {
        let n_samples = targets.len();
        let before_last = &plan.stages[..plan.stages.len().saturating_sub(1)];
        let subsets: Vec<(Mat<f64>, Vec<f64>)> = (before_last.iter())
            .map(|stage| subset(x, targets, &spread_rows(n_samples, stage.n_samples)))
            .collect();
        let on = |stage: usize| match subsets.get(stage) {
            Some((x, targets)) => LogMarginal::new(x.as_ref(), targets, likelihood),
            None => LogMarginal::new(x, targets, likelihood),
        };
        Self::new(climb(on, starts, plan)?, x, targets, likelihood)
    }
}

/// Maximises eq. (8) over the hyperparameters of a covariance and σ, and conditions on the data.
///
/// Beyond 512 samples the starts are compared on a few of them and the highest goes on to more and
/// more, unless `options.scheme` asks for all samples from the beginning.
/// Sequential and deterministic; `options.starts` is not used.
/// # Shapes
/// `x` (n, d), rows as the covariance needs them; `targets` (n,).
/// # Errors
/// Fewer than 2 samples, data that is not finite or does not match, a σ that is not positive, or no
/// start with a finite likelihood.
/// # Panics
/// If `x` does not have the number of columns that a covariance needs.
/// # Source
/// Sec. 3 and A.1, for other covariances than that of a torque.
pub fn fit_covariance<C: Covariance + Clone>(
    x: MatRef<'_, f64>,
    targets: &[f64],
    starts: &[Start<C>],
    options: &FitOptions,
) -> Result<Fit<C>, GpError> {
    require_training_data(x, targets, 2)?;
    for start in starts {
        require_noise(start.noise_std)?;
    }
    let plan = Plan::compared(targets.len(), options.scheme, options.limits());
    Fit::climb(x, targets, starts, &plan, options.likelihood)
}
