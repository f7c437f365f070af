//! The search for the highest likelihood from one start, for any covariance.

use kernels::{Covariance, Jitter, ParamLayout};

use crate::error::GpError;
use crate::evidence::Evaluation;
use crate::fit::FitOptions;
use crate::fit_report::StartReport;
use crate::init::StartKind;
use crate::log_marginal::LogMarginal;
use crate::optimize::{MinimizeOptions, Minimum, Reparametrised, minimize};

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
    /// How it went; its likelihood is −∞ if the start has none.
    pub report: StartReport,
}

impl<C: Covariance> SearchEnd<C> {
    /// Hyperparameters that ended on a bound, by name.
    pub fn bounds_hit(&self) -> Vec<String> {
        let mut theta = self.covariance.params();
        theta.push(self.noise_std);
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
    let mut trial = covariance.clone();
    let mut initial_log_marginal = None;
    let mut is_first = true;
    let negative_log_marginal = |theta: &[f64], gradient: &mut [f64]| {
        let (of_covariance, noise_std) = split_noise(theta);
        trial.set_params(of_covariance);
        if rounding_bound(evidence, &trial, noise_std) > MAX_ROUNDING {
            return f64::INFINITY;
        }
        let outcome = (evidence.evaluate(&trial, noise_std, gradient))
            .map(|evaluation| evaluation.log_marginal_likelihood);
        if std::mem::take(&mut is_first) {
            initial_log_marginal = outcome.as_ref().ok().copied();
        }
        for component in gradient.iter_mut() {
            *component = -*component;
        }
        outcome.map_or(f64::INFINITY, |value| -value)
    };

    let mut theta = covariance.params();
    theta.push(noise_std);
    let mut objective = Reparametrised::new(&search_layout(covariance), negative_log_marginal);
    let z = objective.unconstrained(&theta);
    let minimum = minimize(&mut objective, &z, &minimize_options(options));
    let theta = objective.natural(&minimum.z);
    drop(objective);

    let (of_covariance, noise_std) = split_noise(&theta);
    trial.set_params(of_covariance);
    SearchEnd {
        covariance: trial,
        noise_std,
        report: start_report(kind, initial_log_marginal, &minimum),
    }
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
fn rounding_bound<C>(evidence: &impl Likelihood<C>, covariance: &C, noise_std: f64) -> f64 {
    let largest = evidence.largest_variance(covariance);
    evidence.n_samples() as f64 * f64::EPSILON * largest / (noise_std * noise_std)
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

/// (θ of the covariance, σ).
///
/// # Panics
/// If there is no σ.
fn split_noise(theta: &[f64]) -> (&[f64], f64) {
    let (noise_std, of_covariance) = theta.split_last().expect("σ is the last hyperparameter");
    (of_covariance, *noise_std)
}
