//! The search for the highest likelihood from one start, for any covariance.

use std::cell::{Cell, RefCell};

use faer::MatRef;
use kernels::{Covariance, Jitter, ParamLayout, TorqueCovariance};

use crate::candidate::Candidate;
use crate::error::GpError;
use crate::evidence::{Evaluation, MethodUsed};
use crate::fit::FitOptions;
use crate::fit_report::StartReport;
use crate::init::StartKind;
use crate::log_marginal::LogMarginal;
use crate::opening::{Opening, enough_noise};
use crate::optimize::{
    Budgeted, Known, Metric, MinimizeOptions, Minimum, Objective, Reparametrised, Resumed, Scaled,
    StopReason, minimize,
};
use crate::search_metric::{add_prior_information, information};

// DEVIATION(sec. 3): the chapter's search has no such limit.
/// Points of a search whose likelihood may be wrong by more nats than this are not entered.
///
/// A weight that runs off to 10⁵ N·m beside σ = 10⁻² leaves a likelihood that
/// jumps by half a nat between neighbours, in which no line search finds its way.
const MAX_ROUNDING: f64 = 0.1;

/// Evaluations after which the metric of a search is renewed, and the number beyond
/// `MANY_SAMPLES`, where one evaluation costs more than the metric.
const ROUND: usize = 150;
const SHORT_ROUND: usize = 40;
const MANY_SAMPLES: usize = 512;

/// Nats that a round must gain for another to follow, once the search has stalled.
const WORTH_A_ROUND: f64 = 0.01;

/// Standard deviation of what a faded term adds to the function when it is brought back, in units of σ/√n.
const AUDIBLE: f64 = 1.0;

/// Change of the logarithm of a faded hyperparameter that is worth the likelihood it takes.
const WORTH_A_MOVE: f64 = 0.1;

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

    /// The inputs of each part of the data, (n_p, d); parts are independent given (θ, σ).
    fn parts(&self) -> Vec<MatRef<'_, f64>>;
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

    fn parts(&self) -> Vec<MatRef<'_, f64>> {
        vec![self.x()]
    }
}

/// n, in all parts of the data together.
pub(crate) fn n_samples<C>(evidence: &impl Likelihood<C>) -> usize {
    evidence.parts().iter().map(MatRef::nrows).sum()
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
    /// −log p with its gradient, in unconstrained coordinates; `None` before the first evaluation.
    known: Option<Known>,
    /// Why the start has no likelihood; `None` if it has one.
    pub(crate) failure: Option<GpError>,
}

impl<C: Covariance> SearchEnd<C> {
    /// A search that has not begun.
    pub(crate) fn at(covariance: C, noise_std: f64, kind: StartKind) -> Self {
        Self {
            covariance,
            noise_std,
            known: None,
            failure: None,
            report: StartReport {
                kind,
                initial_log_marginal: None,
                log_marginal: f64::NEG_INFINITY,
                iterations: 0,
                evaluations: 0,
                work: 0.0,
                recoveries: 0,
                projected_gradient: f64::INFINITY,
                stop: StopReason::StartUndefined,
            },
        }
    }

    /// Brings back what has faded; whether there was anything.
    fn make_audible(&mut self, parts: &[MatRef<'_, f64>]) -> bool {
        let n_samples: usize = parts.iter().map(MatRef::nrows).sum();
        let Some(largest) = parts.iter().max_by_key(|x| x.nrows()) else {
            return false;
        };
        let amplitude = AUDIBLE * self.noise_std / (n_samples as f64).sqrt();
        let theta = self.covariance.revived(*largest, amplitude);
        let is_changed = (theta.iter().zip(self.covariance.params()))
            .any(|(there, here)| (there / here).ln().abs() > WORTH_A_MOVE);
        if is_changed {
            self.covariance.set_params(&theta);
            self.known = None;
        }
        is_changed
    }

    /// Returns to an earlier point.
    fn fall_back_to(&mut self, earlier: Self) {
        self.covariance = earlier.covariance;
        self.noise_std = earlier.noise_std;
        self.known = earlier.known;
        self.report.log_marginal = earlier.report.log_marginal;
        self.report.projected_gradient = earlier.report.projected_gradient;
    }

    /// Hyperparameters that ended on a bound, by name.
    pub fn bounds_hit(&self) -> Vec<String> {
        let theta = with_noise(&self.covariance, self.noise_std);
        (search_layout(&self.covariance).specs().iter().zip(theta))
            .filter(|(spec, value)| spec.transform.is_at_bound(*value))
            .map(|(spec, _)| spec.to_string())
            .collect()
    }

    /// Adds a further round of the search, of `evaluations` that cost `work`.
    fn add(&mut self, round: &Minimum, evaluations: usize, work: f64) {
        let report = &mut self.report;
        let start = Some(-round.start_value).filter(|value| value.is_finite());
        report.initial_log_marginal = report.initial_log_marginal.or(start);
        report.log_marginal = -round.value;
        report.iterations += round.iterations;
        report.evaluations += evaluations;
        report.work += work;
        report.recoveries += round.recoveries;
        report.projected_gradient = round.projected_gradient;
        report.stop = round.stop;
    }
}

/// Climbs eq. (8) from one start, over the hyperparameters of the covariance and σ.
///
/// Bounds are those of the covariance's layout and σ² ≥ 10⁻⁴; entries that may have
/// any sign are searched as they are.
/// Steps are taken in the logarithms of the hyperparameters; see [`refine`] for the last part of the way.
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
    let mut end = SearchEnd::at(covariance.clone(), noise_std, kind);
    go_on(evidence, &mut end, None, options);
    end
}

/// Goes on from where a search ended, in the metric of the Fisher information.
///
/// ```text
/// dθ measured by F + I,   F_ij = ½ tr(C⁻¹ ∂_iC C⁻¹ ∂_jC),   C = K + σ²I
/// ```
/// in the logarithms of the hyperparameters, so that the first step is one of Fisher's
/// scoring, and a valley as narrow as the data are precise becomes round.
/// F is renewed every 150 evaluations, or 40 on many samples, and comes from at most 256 of the samples.
/// Hyperparameters that have faded, such as length scales on their way to infinity, are
/// brought back before: see [`Covariance::revived`].
/// `options` limits the evaluations and the work of this part alone.
/// The likelihood never falls.
/// # Panics
/// As for [`search`].
/// # Source
/// Mardia & Marshall 1984, sec. 2; Amari 1998 for the metric.
pub fn refine<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    end: &mut SearchEnd<C>,
    options: &FitOptions,
) {
    let round = if n_samples(evidence) > MANY_SAMPLES {
        SHORT_ROUND
    } else {
        ROUND
    };
    let (mut evaluations, mut work) = (options.max_evaluations, options.max_work);
    let mut is_settled = true;
    while evaluations > 0 && work > 0.0 {
        let before = end.clone();
        let is_moved = is_settled && end.make_audible(&evidence.parts());
        if before.report.stop == StopReason::GradientSmall && !is_moved {
            return;
        }
        let of_round = FitOptions {
            max_evaluations: evaluations.min(round),
            max_work: work,
            ..options.clone()
        };
        let metric = fisher_metric(evidence, end);
        go_on(evidence, end, metric, &of_round);

        let gain = end.report.log_marginal - before.report.log_marginal;
        let used = end.report.evaluations - before.report.evaluations;
        evaluations = evaluations.saturating_sub(used.max(1));
        work -= end.report.work - before.report.work;
        is_settled = end.report.stop != StopReason::EvaluationLimit;
        if gain < 0.0 {
            end.fall_back_to(before);
        }
        if is_settled && !(gain.is_finite() && gain >= WORTH_A_ROUND) {
            return;
        }
    }
}

/// Climbs from where an optimum is near, such as the end of a search on fewer data: [`refine`] from the
/// first evaluation.
///
/// Of more data rounding may leave too little of the likelihood there; σ is then raised until it is within
/// half the limit.
/// # Panics
/// As for [`search`].
pub fn search_near<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
    kind: StartKind,
    options: &FitOptions,
) -> SearchEnd<C> {
    let with = |max_evaluations| FitOptions {
        max_evaluations,
        ..options.clone()
    };
    let noise_std = enough_noise(evidence, covariance, noise_std, MAX_ROUNDING);
    let mut end = search(evidence, covariance, noise_std, kind, &with(1));
    let left = options.max_evaluations.saturating_sub(1);
    refine(evidence, &mut end, &with(left));
    end
}

/// Climbs from a candidate: from a stage with fewer samples, with noise enough for more of them.
pub(crate) fn search_on(
    evidence: &mut LogMarginal<'_>,
    from: &Candidate,
    options: &FitOptions,
) -> SearchEnd<TorqueCovariance> {
    let mut start = from.clone();
    if !from.is_heir {
        return search(
            evidence,
            &start.covariance,
            start.noise_std,
            start.kind,
            options,
        );
    }
    start.keep_inside();
    let opening = Opening::find(evidence, &start.covariance, start.noise_std, MAX_ROUNDING);
    let mut end = SearchEnd::at(start.covariance, start.noise_std, start.kind);
    let mut left = options.max_work;
    if let Some(opening) = opening {
        left -= opening.work;
        end.open_with(&opening);
    }
    let options = FitOptions {
        max_work: left,
        ..options.clone()
    };
    refine(evidence, &mut end, &options);
    end
}

impl<C: Covariance> SearchEnd<C> {
    /// Sets out from a point that has been evaluated.
    fn open_with(&mut self, opening: &Opening) {
        self.noise_std = opening.noise_std;
        let objective = Reparametrised::new(
            &search_layout(&self.covariance),
            |_: &[f64], _: &mut [f64]| 0.0,
        );
        let z = objective.unconstrained(&with_noise(&self.covariance, self.noise_std));
        let mut gradient: Vec<f64> = opening.gradient.iter().map(|g| -g).collect();
        objective.pull_back(&z, &mut gradient);
        self.report.initial_log_marginal = Some(opening.log_marginal);
        self.report.log_marginal = opening.log_marginal;
        self.report.evaluations = opening.evaluations;
        self.report.work = opening.work;
        self.report.projected_gradient = objective.projected_gradient(&z, &gradient);
        self.report.stop = StopReason::WorkLimit;
        self.known = Some(Known {
            z,
            value: -opening.log_marginal,
            gradient,
        });
    }
}

/// One run of the optimiser from where the search is, in the coordinates of a metric.
fn go_on<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    end: &mut SearchEnd<C>,
    metric: Option<Metric>,
    options: &FitOptions,
) {
    let mut trial = end.covariance.clone();
    let work = Cell::new(0.0);
    let failure = RefCell::new(None);
    let n_samples = n_samples(evidence);
    let negative_log_marginal = |theta: &[f64], gradient: &mut [f64]| {
        let (of_covariance, noise_std) = split_noise(theta);
        trial.set_params(of_covariance);
        let nats = rounding_bound(evidence, &trial, noise_std);
        if nats > MAX_ROUNDING {
            let largest = MAX_ROUNDING;
            failure.replace(Some(GpError::TooMuchRounding {
                n_samples,
                nats,
                largest,
            }));
            return f64::INFINITY;
        }
        let outcome = evidence.evaluate(&trial, noise_std, gradient);
        work.set(work.get() + work_of(outcome.as_ref().ok(), n_samples));
        for component in gradient.iter_mut() {
            *component = -*component;
        }
        match outcome {
            Ok(evaluation) => -evaluation.log_marginal_likelihood,
            Err(error) => {
                failure.replace(Some(error));
                f64::INFINITY
            }
        }
    };

    let objective = Reparametrised::new(&search_layout(&end.covariance), negative_log_marginal);
    let z = match end.known.as_ref() {
        Some(known) => known.z.clone(),
        None => objective.unconstrained(&with_noise(&end.covariance, end.noise_std)),
    };
    let n_known = usize::from(end.known.is_some());
    let objective = Resumed::new(objective, end.known.take());
    let objective = Scaled::new(objective, z, metric);
    let start = objective.start();
    let mut objective = Budgeted::new(objective, &work, options.max_work);
    let minimum = minimize(&mut objective, &start, &minimize_options(options));

    let scaled = objective.into_inner();
    let known = Known {
        z: scaled.outer(&minimum.z),
        value: minimum.value,
        gradient: scaled.outer_gradient(&minimum.gradient),
    };
    let theta = scaled.into_inner().into_inner().natural(&known.z);
    let (of_covariance, noise_std) = split_noise(&theta);
    end.covariance.set_params(of_covariance);
    end.noise_std = noise_std;
    end.known = Some(known).filter(|known| known.value.is_finite());
    end.failure = failure.take().filter(|_| end.known.is_none());
    let n_new = minimum.evaluations.saturating_sub(n_known);
    end.add(&minimum, n_new, work.get());
}

/// The metric where a search is.
fn fisher_metric<C: Covariance + Clone>(
    evidence: &impl Likelihood<C>,
    end: &SearchEnd<C>,
) -> Option<Metric> {
    let z = match end.known.as_ref() {
        Some(known) => known.z.clone(),
        None => Reparametrised::new(
            &search_layout(&end.covariance),
            |_: &[f64], _: &mut [f64]| 0.0,
        )
        .unconstrained(&with_noise(&end.covariance, end.noise_std)),
    };
    let mut information = information(&evidence.parts(), &end.covariance, &z)?;
    add_prior_information(&mut information);
    Metric::new(information.as_ref())
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
pub(crate) fn search_layout<C: Covariance>(covariance: &C) -> ParamLayout {
    let noise = Jitter::new(1.0).expect("one is positive");
    covariance.layout().followed_by(noise.layout())
}

/// Roughly the error that rounding K leaves in its log marginal likelihood, in nats.
///
/// ```text
/// |Σ_ab Q_ab δK_ab| ≲ n ε max_a K_aa / σ²,   as |δK_ab| ≤ ε max K and ‖K⁻¹‖ ≤ 1/σ²
/// ```
pub(crate) fn rounding_bound<C: Covariance>(
    evidence: &impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
) -> f64 {
    let parts = evidence.parts();
    let n_samples: usize = parts.iter().map(MatRef::nrows).sum();
    let variances = parts.into_iter().flat_map(|x| covariance.diag(x));
    let largest = variances.fold(0.0, f64::max);
    n_samples as f64 * f64::EPSILON * largest / (noise_std * noise_std)
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
pub(crate) fn split_noise(theta: &[f64]) -> (&[f64], f64) {
    let (noise_std, of_covariance) = theta.split_last().expect("σ is the last hyperparameter");
    (of_covariance, *noise_std)
}
