//! Learning the hyperparameters of one joint's torque by maximum marginal likelihood.

use faer::MatRef;
use kernels::{TorqueCovariance, TorqueForm};

use crate::data::{joints_of, require_training_data};
use crate::error::GpError;
use crate::evidence::LikelihoodOptions;
use crate::fit_posterior::FitPosterior;
use crate::fit_report::FitReport;
use crate::init::{StartKind, StartPoint, chapter_start, varied_start};
use crate::log_marginal::LogMarginal;
use crate::search::{SearchEnd, search};

/// From where the search sets out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Starts {
    /// Eq. (22) alone.
    Chapter,
    // DEVIATION(A.1): the chapter has one start, from which the squared exponential is
    // often switched off before it is tried.
    /// Eq. (22) and variations of it; the highest likelihood is kept.
    Several,
}

impl Starts {
    /// The variations of eq. (22) that it stands for, in the order tried.
    pub fn kinds(self) -> &'static [StartKind] {
        match self {
            Self::Chapter => &[StartKind::Chapter],
            Self::Several => &[
                StartKind::Chapter,
                StartKind::DoubleLengthScales,
                StartKind::TypicalPairs,
                StartKind::TypicalPairsLowNoise,
            ],
        }
    }
}

/// How long and how hard to search.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// The starts.
    pub starts: Starts,
    /// Likelihoods with gradient that each start may use.
    pub max_evaluations: usize,
    /// Converged when no component of the projected gradient with respect to the
    /// logarithms of the hyperparameters is larger, in nats.
    pub gradient_tolerance: f64,
    /// Stalled when an iteration gains less than this, in nats.
    pub value_tolerance: f64,
    /// How each likelihood is computed.
    pub likelihood: LikelihoodOptions,
}

impl FitOptions {
    /// Eq. (22) alone, with up to 300 evaluations.
    pub fn chapter() -> Self {
        Self {
            starts: Starts::Chapter,
            max_evaluations: 300,
            gradient_tolerance: 1e-3,
            value_tolerance: 1e-5,
            likelihood: LikelihoodOptions::automatic(),
        }
    }

    /// Several starts, with up to 300 evaluations each.
    pub fn several() -> Self {
        Self {
            starts: Starts::Several,
            ..Self::chapter()
        }
    }
}

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

    let mut evidence = LogMarginal::new(x, targets, options.likelihood);
    let ends: Vec<SearchEnd<TorqueCovariance>> = (starts.iter())
        .map(|s| search(&mut evidence, &s.covariance, s.noise_std, s.kind, options))
        .collect();
    // Its matrices are as large as those of the posterior to come.
    drop(evidence);
    let winner = highest(&ends).ok_or(GpError::NoUsableStart {
        n_starts: starts.len(),
    })?;

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
        starts: ends.into_iter().map(|end| end.report).collect(),
    };
    Ok(Fit { posterior, report })
}

/// Index of the highest finite likelihood; the earliest of equals.
fn highest<C>(ends: &[SearchEnd<C>]) -> Option<usize> {
    let mut best: Option<usize> = None;
    for (idx, end) in ends.iter().enumerate() {
        let value = end.report.log_marginal;
        let is_higher = best.is_none_or(|best| value > ends[best].report.log_marginal);
        if value.is_finite() && is_higher {
            best = Some(idx);
        }
    }
    best
}
