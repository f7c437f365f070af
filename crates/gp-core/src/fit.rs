//! Learning the hyperparameters of one joint's torque by maximum marginal likelihood.

use faer::MatRef;
use kernels::{Covariance, Jitter, ParamLayout, TorqueCovariance, TorqueForm};

use crate::data::{joints_of, require_training_data};
use crate::error::GpError;
use crate::evidence::LikelihoodOptions;
use crate::fit_posterior::FitPosterior;
use crate::fit_report::{FitReport, StartReport};
use crate::init::{StartKind, StartPoint, chapter_start, varied_start};
use crate::log_marginal::LogMarginal;
use crate::optimize::{MinimizeOptions, Minimum, Reparametrised, minimize};

// DEVIATION(sec. 3): the chapter's search has no such limit.
/// Points of a search whose likelihood may be wrong by more nats than this are not entered.
///
/// A weight that runs off to 10⁵ N·m beside σ = 10⁻² leaves a likelihood that
/// jumps by half a nat between neighbours, in which no line search finds its way.
const MAX_ROUNDING: f64 = 0.1;

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
    fn kinds(self) -> &'static [StartKind] {
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
    let ends: Vec<SearchEnd> = (starts.iter())
        .map(|start| search(&mut evidence, start, options))
        .collect();
    // Its matrices are as large as those of the posterior to come.
    drop(evidence);
    let winner = highest(&ends).ok_or(GpError::NoUsableStart {
        n_starts: starts.len(),
    })?;

    let mut covariance = starts[winner].covariance.clone();
    let (theta, noise_std) = split_noise(&ends[winner].theta);
    covariance.set_params(theta);
    let layout = fit_layout(&covariance);
    let (posterior, error_bound) =
        FitPosterior::with_error_bound(covariance, noise_std, x, targets, options.likelihood)?;
    let report = FitReport {
        log_marginal: ends[winner].report.log_marginal,
        winner,
        bounds_hit: bounds_hit(&layout, &ends[winner].theta),
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

/// Where the search from one start ended: (θ, σ) and its report.
struct SearchEnd {
    theta: Vec<f64>,
    report: StartReport,
}

/// Hyperparameters of the covariance followed by σ.
fn fit_layout(covariance: &TorqueCovariance) -> ParamLayout {
    let noise = Jitter::new(1.0).expect("one is positive");
    covariance.layout().followed_by(noise.layout())
}

fn search(evidence: &mut LogMarginal<'_>, start: &StartPoint, options: &FitOptions) -> SearchEnd {
    let mut covariance = start.covariance.clone();
    let mut initial_log_marginal = None;
    let mut is_first = true;
    let negative_log_marginal = |theta: &[f64], gradient: &mut [f64]| {
        let (of_covariance, noise_std) = split_noise(theta);
        covariance.set_params(of_covariance);
        if rounding_bound(&covariance, noise_std, evidence.x()) > MAX_ROUNDING {
            return f64::INFINITY;
        }
        let outcome = (evidence.evaluate(&covariance, noise_std, gradient))
            .map(|evaluation| evaluation.log_marginal_likelihood);
        if std::mem::take(&mut is_first) {
            initial_log_marginal = outcome.as_ref().ok().copied();
        }
        for component in gradient.iter_mut() {
            *component = -*component;
        }
        outcome.map_or(f64::INFINITY, |value| -value)
    };

    let mut theta = start.covariance.params();
    theta.push(start.noise_std);
    let mut objective = Reparametrised::new(&fit_layout(&start.covariance), negative_log_marginal);
    let z = objective.unconstrained(&theta);
    let minimum = minimize(&mut objective, &z, &minimize_options(options));
    let theta = objective.natural(&minimum.z);
    drop(objective);
    SearchEnd {
        theta,
        report: start_report(start.kind, initial_log_marginal, &minimum),
    }
}

/// Roughly the error that rounding K leaves in its log marginal likelihood, in nats.
///
/// ```text
/// |Σ_ab Q_ab δK_ab| ≲ n ε max_a K_aa / σ²,   as |δK_ab| ≤ ε max K and ‖K⁻¹‖ ≤ 1/σ²
/// ```
fn rounding_bound(covariance: &TorqueCovariance, noise_std: f64, x: MatRef<'_, f64>) -> f64 {
    let largest = covariance.diag(x).into_iter().fold(0.0, f64::max);
    x.nrows() as f64 * f64::EPSILON * largest / (noise_std * noise_std)
}

fn minimize_options(options: &FitOptions) -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: options.gradient_tolerance,
        value_tolerance: options.value_tolerance,
        max_evaluations: options.max_evaluations,
        max_recoveries: 10,
    }
}

fn start_report(
    kind: StartKind,
    initial_log_marginal: Option<f64>,
    minimum: &Minimum,
) -> StartReport {
    StartReport {
        kind,
        initial_log_marginal,
        log_marginal: -minimum.value,
        iterations: minimum.iterations,
        evaluations: minimum.evaluations,
        recoveries: minimum.recoveries,
        projected_gradient: minimum.projected_gradient,
        stop: minimum.stop,
    }
}

/// Index of the highest finite likelihood; the earliest of equals.
fn highest(ends: &[SearchEnd]) -> Option<usize> {
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

/// (θ of the covariance, σ).
///
/// # Panics
/// If there is no σ.
fn split_noise(theta: &[f64]) -> (&[f64], f64) {
    let (noise_std, of_covariance) = theta.split_last().expect("σ is the last hyperparameter");
    (of_covariance, *noise_std)
}

fn bounds_hit(layout: &ParamLayout, theta: &[f64]) -> Vec<String> {
    (layout.specs().iter().zip(theta))
        .filter(|(spec, value)| spec.transform.is_at_bound(**value))
        .map(|(spec, _)| spec.to_string())
        .collect()
}
