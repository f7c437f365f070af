//! The search for the highest likelihood from one start, for any covariance.

use std::cell::Cell;

use kernels::{Covariance, Jitter, ParamLayout, TorqueCovariance};

use crate::error::GpError;
use crate::evidence::{Evaluation, MethodUsed};
use crate::fit::FitOptions;
use crate::fit_report::StartReport;
use crate::heirs::Candidate;
use crate::init::StartKind;
use crate::log_marginal::LogMarginal;
use crate::opening::Opening;
use crate::optimize::{
    Budgeted, Curvature, MinimizeOptions, Minimum, Reparametrised, Scaled, minimize,
};

// DEVIATION(sec. 3): the chapter's search has no such limit.
/// Points of a search whose likelihood may be wrong by more nats than this are not entered.
///
/// A weight that runs off to 10⁵ N·m beside σ = 10⁻² leaves a likelihood that
/// jumps by half a nat between neighbours, in which no line search finds its way.
const MAX_ROUNDING: f64 = 0.1;

/// What a search climbs: eq. (8) of some covariance on some data.
///
/// [`LogMarginal`] is one; a sum of it over independent parts of the data is another.
pub trait Likelihood<C> {
    /// The value and its gradient with respect to (θ, σ).
    ///
    /// # Errors
    /// Where there is no value; a search backs away from there.
    /// # Panics
    /// If `gradient` does not have one entry per hyperparameter and one for σ.
    fn evaluate(
        &mut self,
        covariance: &C,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError>;

    /// n, in all parts of the data together.
    fn n_samples(&self) -> usize;

    /// max_a c(x_a, x_a) over the data.
    fn largest_variance(&self, covariance: &C) -> f64;
}

impl<C: Covariance> Likelihood<C> for LogMarginal<'_> {
    fn evaluate(
        &mut self,
        covariance: &C,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError> {
        LogMarginal::evaluate(self, covariance, noise_std, gradient)
    }

    fn n_samples(&self) -> usize {
        self.x().nrows()
    }

    fn largest_variance(&self, covariance: &C) -> f64 {
        covariance.diag(self.x()).into_iter().fold(0.0, f64::max)
    }
}

/// Where the search from one start ended.
#[derive(Debug, Clone)]
pub struct SearchEnd<C> {
    /// The covariance with the hyperparameters found.
    pub covariance: C,
    /// σ found, in target units.
    pub noise_std: f64,
    /// What was learned of the curvature of eq. (8).
    pub curvature: Curvature,
    /// How it went; its likelihood is −∞ if the start has none.
    pub report: StartReport,
}

impl<C: Covariance> SearchEnd<C> {
    /// Hyperparameters that ended on a bound, by name.
    pub fn bounds_hit(&self) -> Vec<String> {
        let theta = with_noise(&self.covariance, self.noise_std);
        (search_layout(&self.covariance).specs().iter().zip(theta))
            .filter(|(spec, value)| spec.transform.is_at_bound(*value))
            .map(|(spec, _)| spec.to_string())
            .collect()
    }
}

/// Climbs eq. (8) from one start, over the hyperparameters of the covariance and σ.
///
/// Bounds are those of the covariance's layout and σ² ≥ 10⁻⁴; entries that may have
/// any sign are searched as they are.
/// The likelihood at the end is never below that at the start.
/// Sequential and deterministic; `options.starts` is not used.
/// # Panics
/// If the inputs do not have the number of columns that the covariance needs.
/// # Source
/// Sec. 3 and A.1.
pub fn search<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
    kind: StartKind,
    options: &FitOptions,
) -> SearchEnd<C> {
    let nothing_known = Curvature::default();
    search_scaled(
        evidence,
        (covariance, noise_std),
        kind,
        options,
        nothing_known,
        None,
    )
}

/// Climbs as [`search`] does, with what an earlier search nearby learned of the curvature.
///
/// That search may have seen fewer data.
/// A curvature of another number of hyperparameters is not used.
/// # Panics
/// As for [`search`].
pub fn search_near<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    (covariance, noise_std): (&C, f64),
    kind: StartKind,
    options: &FitOptions,
    curvature: Curvature,
) -> SearchEnd<C> {
    search_scaled(
        evidence,
        (covariance, noise_std),
        kind,
        options,
        curvature,
        None,
    )
}

/// Climbs from a candidate, with what is known of the curvature there.
pub(crate) fn search_on(
    evidence: &mut LogMarginal<'_>,
    from: &Candidate,
    options: &FitOptions,
) -> SearchEnd<TorqueCovariance> {
    let mut start = from.clone();
    let mut opening = None;
    if from.is_heir {
        start.keep_inside();
        let (covariance, noise_std) = (&start.covariance, start.noise_std);
        opening = Opening::find(evidence, covariance, noise_std, MAX_ROUNDING);
        if let Some(opening) = &opening {
            start.noise_std = opening.noise_std;
        }
    }
    let of = (&start.covariance, start.noise_std);
    search_scaled(evidence, of, start.kind, options, start.curvature, opening)
}

fn search_scaled<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    (covariance, noise_std): (&C, f64),
    kind: StartKind,
    options: &FitOptions,
    curvature: Curvature,
    mut opening: Option<Opening>,
) -> SearchEnd<C> {
    let mut trial = covariance.clone();
    let mut initial_log_marginal = None;
    let mut is_first = true;
    let work = Cell::new(opening.as_ref().map_or(0.0, |opening| opening.work));
    let n_samples = evidence.n_samples();
    // The first point of the search is the opening, which has been evaluated.
    let n_before = opening.as_ref().map_or(0, |known| known.evaluations - 1);
    let negative_log_marginal = |theta: &[f64], gradient: &mut [f64]| {
        let (of_covariance, noise_std) = split_noise(theta);
        trial.set_params(of_covariance);
        if rounding_bound(evidence, &trial, noise_std) > MAX_ROUNDING {
            return f64::INFINITY;
        }
        let outcome = if let Some(known) = opening.take() {
            gradient.copy_from_slice(&known.gradient);
            Ok(known.log_marginal)
        } else {
            let outcome = evidence.evaluate(&trial, noise_std, gradient);
            work.set(work.get() + work_of(outcome.as_ref().ok(), n_samples));
            outcome.map(|evaluation| evaluation.log_marginal_likelihood)
        };
        if std::mem::take(&mut is_first) {
            initial_log_marginal = outcome.as_ref().ok().copied();
        }
        for component in gradient.iter_mut() {
            *component = -*component;
        }
        outcome.map_or(f64::INFINITY, |value| -value)
    };

    let theta = with_noise(covariance, noise_std);
    let objective = Reparametrised::new(&search_layout(covariance), negative_log_marginal);
    let z = objective.unconstrained(&theta);
    let objective = Scaled::new(objective, z.clone(), curvature);
    let start = objective.inner(&z);
    let mut objective = Budgeted::new(objective, &work, options.max_work);
    let minimum = minimize(&mut objective, &start, &minimize_options(options));
    let scaled = objective.into_inner();
    let z = scaled.outer(&minimum.z);
    let (objective, curvature) = scaled.into_parts();
    let theta = objective.natural(&z);
    drop(objective);

    let (of_covariance, noise_std) = split_noise(&theta);
    trial.set_params(of_covariance);
    SearchEnd {
        covariance: trial,
        noise_std,
        curvature,
        report: start_report((kind, initial_log_marginal), n_before, work.get(), &minimum),
    }
}

fn start_report(
    (kind, initial_log_marginal): (StartKind, Option<f64>),
    n_before: usize,
    work: f64,
    minimum: &Minimum,
) -> StartReport {
    StartReport {
        kind,
        initial_log_marginal,
        log_marginal: -minimum.value,
        iterations: minimum.iterations,
        evaluations: n_before + minimum.evaluations,
        work,
        recoveries: minimum.recoveries,
        projected_gradient: minimum.projected_gradient,
        stop: minimum.stop,
    }
}

/// The values nearest to θ and σ from which a search can set out: inside their bounds.
pub(crate) fn inside_bounds<C: Covariance>(covariance: &mut C, noise_std: f64) -> f64 {
    let theta = with_noise(covariance, noise_std);
    let bounds = Reparametrised::new(&search_layout(covariance), |_: &[f64], _: &mut [f64]| 0.0);
    let theta = bounds.natural(&bounds.unconstrained(&theta));
    let (of_covariance, noise_std) = split_noise(&theta);
    covariance.set_params(of_covariance);
    noise_std
}

/// Hyperparameters of the covariance followed by σ.
fn search_layout<C: Covariance>(covariance: &C) -> ParamLayout {
    let noise = Jitter::new(1.0).expect("one is positive");
    covariance.layout().followed_by(noise.layout())
}

/// Roughly the error that rounding K leaves in its log marginal likelihood, in nats.
///
/// ```text
/// |Σ_ab Q_ab δK_ab| ≲ n ε max_a K_aa / σ²,   as |δK_ab| ≤ ε max K and ‖K⁻¹‖ ≤ 1/σ²
/// ```
pub(crate) fn rounding_bound<C>(
    evidence: &impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
) -> f64 {
    let largest = evidence.largest_variance(covariance);
    evidence.n_samples() as f64 * f64::EPSILON * largest / (noise_std * noise_std)
}

/// Work of one evaluation, in evaluations by the dense path: roughly, and never by the clock.
///
/// ```text
/// 1                       dense, n³ floating-point operations for factor and inverse
/// 10 r²/n² + 300 r/n²     low-rank: 10 n r² for pivots, orthogonal factor and adjoints,
///                         300 n r for entries of the covariance and their gradient
/// ```
pub(crate) fn work_of(evaluation: Option<&Evaluation>, n_samples: usize) -> f64 {
    let Some(evaluation) = evaluation.filter(|e| e.method == MethodUsed::Certified) else {
        return 1.0;
    };
    let (n, rank) = (n_samples as f64, evaluation.rank as f64);
    (10.0 * rank * rank + 300.0 * rank) / (n * n)
}

fn minimize_options(options: &FitOptions) -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: options.gradient_tolerance,
        value_tolerance: options.value_tolerance,
        max_evaluations: options.max_evaluations,
        max_recoveries: 10,
    }
}

/// θ of the covariance followed by σ.
fn with_noise<C: Covariance>(covariance: &C, noise_std: f64) -> Vec<f64> {
    let mut theta = covariance.params();
    theta.push(noise_std);
    theta
}

/// (θ of the covariance, σ).
///
/// # Panics
/// If there is no σ.
fn split_noise(theta: &[f64]) -> (&[f64], f64) {
    let (noise_std, of_covariance) = theta.split_last().expect("σ is the last hyperparameter");
    (of_covariance, *noise_std)
}
