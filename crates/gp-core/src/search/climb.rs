//! The search for the highest likelihood from one start, for any covariance.

use std::cell::{Cell, RefCell};
use std::mem::discriminant;

use faer::MatRef;
use kernels::{Covariance, TorqueCovariance};

use super::options::FitOptions;
use super::report::StartReport;
use super::start::{StartKind, StartPoint};
use crate::error::GpError;
use crate::evidence::{
    Likelihood, LogMarginal, add_prior_information, information, layout_with_noise, split_noise,
    with_noise,
};
use crate::optimize::{
    Budgeted, Known, Metric, MinimizeOptions, Minimum, Objective, Reparametrised, Resumed, Scaled,
    StopReason, minimize,
};

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
        let theta = self.covariance.audible(*largest, amplitude);
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
        (layout_with_noise(&self.covariance)
            .specs()
            .iter()
            .zip(theta))
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
/// brought back before: see [`Covariance::audible`].
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
    let round = if evidence.n_samples() > MANY_SAMPLES {
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
            &layout_with_noise(&self.covariance),
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
    let n_samples = evidence.n_samples();
    let negative_log_marginal = |theta: &[f64], gradient: &mut [f64]| {
        let (of_covariance, noise_std) = split_noise(theta);
        trial.set_params(of_covariance);
        let nats = evidence.rounding(&trial, noise_std);
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
        work.set(work.get() + evidence.work(&outcome));
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

    let objective = Reparametrised::new(&layout_with_noise(&end.covariance), negative_log_marginal);
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
            &layout_with_noise(&end.covariance),
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
    let bounds = Reparametrised::new(
        &layout_with_noise(covariance),
        |_: &[f64], _: &mut [f64]| 0.0,
    );
    let theta = bounds.natural(&bounds.unconstrained(&theta));
    let (of_covariance, noise_std) = split_noise(&theta);
    covariance.set_params(of_covariance);
    noise_std
}

fn minimize_options(options: &FitOptions) -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: options.gradient_tolerance,
        value_tolerance: options.value_tolerance,
        max_evaluations: options.max_evaluations,
        max_recoveries: 10,
    }
}

/// A point from which a stage sets out.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub kind: StartKind,
    pub covariance: TorqueCovariance,
    pub noise_std: f64,
    /// Whether it comes from a stage with fewer samples.
    pub is_heir: bool,
}

impl Candidate {
    /// A start of the first stage.
    pub fn of(start: &StartPoint) -> Self {
        Self {
            kind: start.kind,
            covariance: start.covariance.clone(),
            noise_std: start.noise_std,
            is_heir: false,
        }
    }

    /// The end of a search on fewer samples.
    pub fn heir(end: &SearchEnd<TorqueCovariance>) -> Self {
        Self {
            kind: end.report.kind,
            covariance: end.covariance.clone(),
            noise_std: end.noise_std,
            is_heir: true,
        }
    }

    /// Moves hyperparameters that sit on a bound a little inside it.
    pub fn keep_inside(&mut self) {
        self.noise_std = inside_bounds(&mut self.covariance, self.noise_std);
    }
}

/// Mean squared standardised residual beyond which σ is raised.
const TOO_SURE: f64 = 4.0;

/// Times that σ is raised at most.
const MAX_RAISES: usize = 2;

/// Part of the limit on rounding at which a search may set out.
const INSIDE: f64 = 0.5;

/// Where a search on more samples sets out, with the likelihood there.
#[derive(Debug, Clone)]
pub(crate) struct Opening {
    pub noise_std: f64,
    pub log_marginal: f64,
    /// With respect to (θ, σ).
    pub gradient: Vec<f64>,
    pub evaluations: usize,
    pub work: f64,
}

impl Opening {
    /// Raises σ until the residuals are no surprise; `None` where there is no likelihood.
    ///
    /// ```text
    /// ρ = σ²|α|²/n ≈ 1 + (σ/n) ∂ log p/∂σ,    σ ← σ √ρ  while ρ > 4, at most twice
    /// ```
    /// as ∂ log p/∂σ = σ(|α|² − tr K⁻¹) and tr K⁻¹ ≤ n/σ²; σ²α are the residuals of the
    /// posterior mean, so that σ√ρ is their root mean square.
    /// # Source
    /// The update of the noise in the EM algorithm, without the posterior variance:
    /// Dempster, Laird & Rubin 1977, sec. 4.
    pub fn find<C: Covariance>(
        evidence: &mut impl Likelihood<C>,
        covariance: &C,
        noise_std: f64,
        max_rounding: f64,
    ) -> Option<Self> {
        let nats = evidence.rounding(covariance, noise_std);
        let mut opening = Self {
            noise_std: raised(noise_std, nats, max_rounding),
            log_marginal: f64::NEG_INFINITY,
            gradient: vec![0.0; covariance.n_params() + 1],
            evaluations: 0,
            work: 0.0,
        };
        for round in 0..=MAX_RAISES {
            let surprise = opening.evaluate(evidence, covariance)?;
            if surprise <= TOO_SURE || round == MAX_RAISES {
                break;
            }
            opening.noise_std *= surprise.sqrt();
        }
        Some(opening)
    }

    /// ρ at the present σ.
    fn evaluate<C: Covariance>(
        &mut self,
        evidence: &mut impl Likelihood<C>,
        covariance: &C,
    ) -> Option<f64> {
        let evaluation = evidence.evaluate(covariance, self.noise_std, &mut self.gradient);
        self.evaluations += 1;
        self.work += evidence.work(&evaluation);
        self.log_marginal = evaluation.ok()?.log_marginal_likelihood;
        let slope = self.gradient.last()?;
        Some(1.0 + self.noise_std * slope / evidence.n_samples() as f64)
    }
}

/// σ, or what it takes for a search to set out where rounding would be more than the limit in nats.
pub(crate) fn enough_noise<C: Covariance>(
    evidence: &impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
    max_rounding: f64,
) -> f64 {
    let nats = evidence.rounding(covariance, noise_std);
    if nats > max_rounding && nats.is_finite() {
        raised(noise_std, nats, max_rounding)
    } else {
        noise_std
    }
}

/// σ at which rounding of so many nats, which goes with 1/σ², is well inside the limit; never a smaller one.
fn raised(noise_std: f64, nats: f64, max_rounding: f64) -> f64 {
    noise_std * (nats / (INSIDE * max_rounding)).max(1.0).sqrt()
}

/// Index of the highest finite likelihood; the earliest of equals.
pub fn highest<C>(ends: &[SearchEnd<C>]) -> Option<usize> {
    let value = |idx: usize| ends[idx].report.log_marginal;
    (0..ends.len())
        .filter(|&idx| value(idx).is_finite())
        .reduce(|best, idx| if value(idx) > value(best) { idx } else { best })
}

/// The error of a search none of whose ends has a likelihood, with the reason if all have the same.
pub fn no_usable_start<C>(ends: &[SearchEnd<C>]) -> GpError {
    let failures: Option<Vec<&GpError>> = ends.iter().map(|end| end.failure.as_ref()).collect();
    let failures = failures.unwrap_or_default();
    let are_alike =
        (failures.windows(2)).all(|pair| discriminant(pair[0]) == discriminant(pair[1]));
    let first = failures.first().filter(|_| are_alike);
    GpError::NoUsableStart {
        n_starts: ends.len(),
        reason: first.map(|&failure| Box::new(failure.clone())),
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "bounds are taken over as they are")]
mod tests {
    use faer::Mat;
    use kernels::{Constant, SeArd};

    use super::*;
    use crate::evidence::LikelihoodOptions;

    #[test]
    fn a_reason_is_given_where_all_starts_have_the_same() {
        let failed = |failure: GpError| {
            let mut end = SearchEnd::at(Constant::new(1.0).unwrap(), 0.1, StartKind::Given);
            end.failure = Some(failure);
            end
        };
        let not_finite = |n_samples| GpError::NonFiniteLikelihood { n_samples };
        let alike = [failed(not_finite(3)), failed(not_finite(4))];
        let (n_starts, first) = (2, Box::new(not_finite(3)));
        let expected = GpError::NoUsableStart {
            n_starts,
            reason: Some(first),
        };
        assert_eq!(no_usable_start(&alike), expected);

        let other = GpError::BadNoise { value: 0.0 };
        let unlike = [failed(not_finite(3)), failed(other)];
        let reason = None;
        let expected = GpError::NoUsableStart { n_starts, reason };
        assert_eq!(no_usable_start(&unlike), expected);
    }

    /// Twenty samples of size 3 with signs in turn, at inputs far from one another.
    fn data() -> (Mat<f64>, Vec<f64>) {
        let x = Mat::from_fn(20, 1, |row, _| 100.0 * row as f64);
        let t = (0..20).map(|row| if row % 2 == 0 { 3.0 } else { -3.0 });
        (x, t.collect())
    }

    #[test]
    fn noise_that_is_too_small_is_raised_to_the_residuals() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        // A function that hardly varies: the residuals are the targets.
        let covariance = Constant::new(1e-6).unwrap();
        let opening = Opening::find(&mut evidence, &covariance, 0.1, 0.1).unwrap();
        // ρ = 900, then about 1.
        assert!((opening.noise_std - 3.0).abs() < 0.01, "{opening:?}");
        assert_eq!(opening.evaluations, 2);
        // −½ Σ t²/σ² − n ln σ − ½ n ln 2π at σ = 3.
        let expected = -10.0 - 20.0 * 3.0_f64.ln() - 10.0 * std::f64::consts::TAU.ln();
        assert!((opening.log_marginal - expected).abs() < 1e-3);
    }

    #[test]
    fn noise_that_suits_stays() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let covariance = SeArd::new(3.0, vec![1.0]).unwrap();
        let opening = Opening::find(&mut evidence, &covariance, 0.5, 0.1).unwrap();
        assert_eq!((opening.noise_std, opening.evaluations), (0.5, 1));
    }

    #[test]
    fn noise_is_raised_to_where_rounding_allows_a_search() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let covariance = SeArd::new(1e6, vec![1.0]).unwrap();
        let opening = Opening::find(&mut evidence, &covariance, 0.01, 0.1).unwrap();
        let bound = evidence.rounding(&covariance, opening.noise_std);
        assert!(bound <= 0.1, "{bound}");
        assert!(opening.noise_std > 0.01);
    }
}
