//! The search for the highest likelihood, for any covariance.
//!
//! [`search`] climbs from one start and [`refine`] goes the last part of the way; [`climb`] follows a plan
//! of such searches, on more and more samples and from fewer and fewer starts.

use std::cell::{Cell, RefCell};
use std::mem::discriminant;

use faer::MatRef;
use kernels::Covariance;

use super::options::Limits;
use super::plan::{MIN_WORK, Plan, Stage, Tried};
use super::report::{self, StageReport, StartReport};
use super::start::{Distance, Origin, Start};
use crate::error::GpError;
use crate::evidence::{
    Likelihood, add_prior_information, information, layout_with_noise, split_noise, with_noise,
};
use crate::optimize::{
    Known, Metric, MinimizeOptions, Minimum, Objective, Reparametrised, Resumed, Scaled,
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
const REVIVED: f64 = 1.0;

/// Change of the logarithm of a faded hyperparameter that is worth the likelihood it takes.
const WORTH_A_MOVE: f64 = 0.1;

/// Mean squared standardised residual beyond which σ is raised.
const TOO_SURE: f64 = 4.0;

/// Times that σ is raised at most.
const MAX_RAISES: usize = 2;

/// Part of the limit on rounding at which a search may set out.
const INSIDE: f64 = 0.5;

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
    failure: Option<GpError>,
}

impl<C: Covariance> SearchEnd<C> {
    /// A search that has not begun.
    fn at(start: Start<C>) -> Self {
        Self {
            covariance: start.covariance,
            noise_std: start.noise_std,
            known: None,
            failure: None,
            report: StartReport {
                origin: start.origin,
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
    fn revive(&mut self, parts: &[MatRef<'_, f64>]) -> bool {
        let n_samples: usize = parts.iter().map(MatRef::nrows).sum();
        let Some(largest) = parts.iter().max_by_key(|x| x.nrows()) else {
            return false;
        };
        let amplitude = REVIVED * self.noise_std / (n_samples as f64).sqrt();
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

    /// Where another search may set out.
    fn into_start(self, distance: Distance) -> Start<C> {
        Start::new(self.report.origin, self.covariance, self.noise_std).at(distance)
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

/// Climbs a likelihood from one start, over the hyperparameters of the covariance and σ.
///
/// Bounds are those of the covariance's layout and σ² ≥ 10⁻⁴; entries that may have
/// any sign are searched as they are.
/// From afar, steps are taken in the logarithms of the hyperparameters; from nearby the search is
/// [`refine`] from the first evaluation: see [`Distance`].
/// The likelihood at the end is never below that at the start.
/// Sequential and deterministic.
/// # Panics
/// If the inputs do not have the number of columns that the covariance needs.
/// # Source
/// Sec. 3 and A.1.
pub fn search<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    start: &Start<C>,
    limits: &Limits,
) -> SearchEnd<C> {
    let mut end = SearchEnd::at(start.clone());
    match start.distance {
        Distance::Far => go_on(evidence, &mut end, None, limits),
        Distance::Near => {
            end.noise_std = enough_noise(evidence, &end.covariance, end.noise_std);
            go_on(evidence, &mut end, None, &limits.with_evaluations(1));
            let left = limits.max_evaluations.saturating_sub(1);
            refine(evidence, &mut end, &limits.with_evaluations(left));
        }
        Distance::MoreSamples => {
            end.move_inside_bounds();
            let work = end.raise_noise(evidence);
            refine(
                evidence,
                &mut end,
                &limits.with_work(limits.max_work - work),
            );
        }
    }
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
/// The limits are those of this part alone.
/// The likelihood never falls.
/// # Panics
/// As for [`search`].
/// # Source
/// Mardia & Marshall 1984, sec. 2; Amari 1998 for the metric.
pub fn refine<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    end: &mut SearchEnd<C>,
    limits: &Limits,
) {
    let round = if evidence.n_samples() > MANY_SAMPLES {
        SHORT_ROUND
    } else {
        ROUND
    };
    let (mut evaluations, mut work) = (limits.max_evaluations, limits.max_work);
    let mut is_settled = true;
    while evaluations > 0 && work > 0.0 {
        let before = end.clone();
        let is_moved = is_settled && end.revive(&evidence.parts());
        if before.report.stop == StopReason::GradientSmall && !is_moved {
            return;
        }
        let of_round = (limits.with_evaluations(evaluations.min(round))).with_work(work);
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

/// One run of the optimiser from where the search is, in the coordinates of a metric.
fn go_on<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    end: &mut SearchEnd<C>,
    metric: Option<Metric>,
    limits: &Limits,
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
    let objective = Resumed::new(objective, end.known.take()).within(&work, limits.max_work);
    let mut scaled = Scaled::new(objective, z, metric);
    let start = scaled.start();
    let minimum = minimize(&mut scaled, &start, &minimize_options(limits));

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

/// Coordinates without a function of them.
type Bounds = Reparametrised<fn(&[f64], &mut [f64]) -> f64>;

/// The bounds of (θ, σ).
fn bounds<C: Covariance>(covariance: &C) -> Bounds {
    Reparametrised::new(&layout_with_noise(covariance), |_, _| 0.0)
}

/// The metric where a search is.
fn fisher_metric<C: Covariance + Clone>(
    evidence: &impl Likelihood<C>,
    end: &SearchEnd<C>,
) -> Option<Metric> {
    let z = match end.known.as_ref() {
        Some(known) => known.z.clone(),
        None => bounds(&end.covariance).unconstrained(&with_noise(&end.covariance, end.noise_std)),
    };
    let mut information = information(&evidence.parts(), &end.covariance, &z)?;
    add_prior_information(&mut information);
    Metric::new(information.as_ref())
}

fn minimize_options(limits: &Limits) -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: limits.gradient_tolerance,
        value_tolerance: limits.value_tolerance,
        max_evaluations: limits.max_evaluations,
        max_recoveries: 10,
    }
}

/// The first likelihood on more samples than before, with noise enough for them.
///
/// Hyperparameters of few samples may be sure of more than many samples bear out:
/// a step that fell between two of them, fitted with hardly any noise, costs
/// 10⁵ nats where samples come closer.
/// A search would spend its work on the way back, so σ is raised first.
impl<C: Covariance> SearchEnd<C> {
    /// Moves hyperparameters that sit on a bound a little inside it.
    fn move_inside_bounds(&mut self) {
        let bounds = bounds(&self.covariance);
        let theta = with_noise(&self.covariance, self.noise_std);
        let theta = bounds.natural(&bounds.unconstrained(&theta));
        let (of_covariance, noise_std) = split_noise(&theta);
        self.covariance.set_params(of_covariance);
        self.noise_std = noise_std;
    }

    /// Raises σ until the residuals are no surprise, and stays as it is where there is no likelihood.
    ///
    /// ```text
    /// ρ = σ²|α|²/n ≈ 1 + (σ/n) ∂ log p/∂σ,    σ ← σ √ρ  while ρ > 4, at most twice
    /// ```
    /// as ∂ log p/∂σ = σ(|α|² − tr K⁻¹) and tr K⁻¹ ≤ n/σ²; σ²α are the residuals of the
    /// posterior mean, so that σ√ρ is their root mean square.
    /// Returns the work that it took; none where there is no likelihood.
    /// # Source
    /// The update of the noise in the EM algorithm, without the posterior variance:
    /// Dempster, Laird & Rubin 1977, sec. 4.
    fn raise_noise(&mut self, evidence: &mut impl Likelihood<C>) -> f64 {
        let nats = evidence.rounding(&self.covariance, self.noise_std);
        let mut noise_std = raised(self.noise_std, nats);
        let mut gradient = vec![0.0; self.covariance.n_params() + 1];
        let (mut evaluations, mut work) = (0, 0.0);
        let log_marginal = loop {
            let outcome = evidence.evaluate(&self.covariance, noise_std, &mut gradient);
            evaluations += 1;
            work += evidence.work(&outcome);
            let Ok(evaluation) = outcome else {
                return 0.0;
            };
            let slope = gradient[gradient.len() - 1];
            let surprise = 1.0 + noise_std * slope / evidence.n_samples() as f64;
            if surprise <= TOO_SURE || evaluations > MAX_RAISES {
                break evaluation.log_marginal_likelihood;
            }
            noise_std *= surprise.sqrt();
        };

        let bounds = bounds(&self.covariance);
        let z = bounds.unconstrained(&with_noise(&self.covariance, noise_std));
        for slope in &mut gradient {
            *slope = -*slope;
        }
        bounds.pull_back(&z, &mut gradient);
        self.noise_std = noise_std;
        self.report.initial_log_marginal = Some(log_marginal);
        self.report.log_marginal = log_marginal;
        self.report.evaluations = evaluations;
        self.report.work = work;
        self.report.projected_gradient = bounds.projected_gradient(&z, &gradient);
        self.report.stop = StopReason::WorkLimit;
        self.known = Some(Known {
            z,
            value: -log_marginal,
            gradient,
        });
        work
    }
}

/// σ, or what it takes for a search to set out where rounding would be more than the limit in nats.
fn enough_noise<C: Covariance>(
    evidence: &impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
) -> f64 {
    let nats = evidence.rounding(covariance, noise_std);
    if nats > MAX_ROUNDING && nats.is_finite() {
        raised(noise_std, nats)
    } else {
        noise_std
    }
}

/// σ at which rounding of so many nats, which goes with 1/σ², is well inside the limit; never a smaller one.
fn raised(noise_std: f64, nats: f64) -> f64 {
    noise_std * (nats / (INSIDE * MAX_ROUNDING)).max(1.0).sqrt()
}

/// Index of the highest finite likelihood; the earliest of equals.
fn highest<C>(ends: &[SearchEnd<C>]) -> Option<usize> {
    report::highest(ends.iter().map(|end| end.report.log_marginal))
}

/// The error of a search none of whose ends has a likelihood, with the reason if all have the same.
fn no_usable_start<C>(ends: &[SearchEnd<C>]) -> GpError {
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

/// The highest end of all searches that a plan asked for.
#[derive(Debug, Clone)]
pub struct Found<C> {
    /// The covariance with the hyperparameters found.
    pub covariance: C,
    /// σ found, in target units.
    pub noise_std: f64,
    /// Log marginal likelihood there, natural log, summed over the data.
    pub log_marginal: f64,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// The searches of every stage.
    pub stages: Vec<StageReport>,
    /// Index in the last stage of the start that led there.
    pub winner: usize,
    /// Where that start is from.
    pub origin: Origin,
}

impl<C> Found<C> {
    /// Where another search may set out.
    pub fn into_start(self) -> Start<C> {
        Start::new(self.origin, self.covariance, self.noise_std)
    }

    /// The same end, with the covariance as part of another.
    pub fn map<D>(self, whole: impl FnOnce(C) -> D) -> Found<D> {
        Found {
            covariance: whole(self.covariance),
            noise_std: self.noise_std,
            log_marginal: self.log_marginal,
            bounds_hit: self.bounds_hit,
            stages: self.stages,
            winner: self.winner,
            origin: self.origin,
        }
    }
}

/// Climbs as a plan says.
///
/// `data` gives the likelihood of a stage, counted from zero, on as many samples as the plan says.
/// Where no search of a stage that set out from the one before has a likelihood, all starts set out again.
/// # Errors
/// [`GpError::NoUsableStart`] if no search of the last stage has a likelihood.
/// # Panics
/// As for [`search`].
pub fn climb<C: Covariance + Clone, L: Likelihood<C>>(
    mut data: impl FnMut(usize) -> L,
    starts: &[Start<C>],
    plan: &Plan,
) -> Result<Found<C>, GpError> {
    let mut ends: Vec<SearchEnd<C>> = Vec::new();
    let mut stages = Vec::new();
    for (idx, stage) in plan.stages.iter().enumerate() {
        let before = highest(&ends).map(|best| ends.swap_remove(best).into_start(plan.later));
        // Its matrices are as large as those of the posterior to come, so it ends here.
        let mut evidence = data(idx);
        ends = from_each(
            &mut evidence,
            &stage.set_out(before.as_ref(), starts),
            stage,
        );
        if before.is_some() && highest(&ends).is_none() {
            let all: Vec<&Start<C>> = starts.iter().collect();
            ends.extend(from_each(&mut evidence, &all, stage));
        }
        stages.push(StageReport {
            n_samples: evidence.n_samples(),
            starts: ends.iter().map(|end| end.report.clone()).collect(),
        });
    }
    let winner = highest(&ends).ok_or_else(|| no_usable_start(&ends))?;
    let end = ends.swap_remove(winner);
    Ok(Found {
        bounds_hit: end.bounds_hit(),
        covariance: end.covariance,
        noise_std: end.noise_std,
        log_marginal: end.report.log_marginal,
        stages,
        winner,
        origin: end.report.origin,
    })
}

impl Stage {
    /// The end of the stage before, if there is one, and the starts beside it.
    fn set_out<'a, C>(
        &self,
        before: Option<&'a Start<C>>,
        starts: &'a [Start<C>],
    ) -> Vec<&'a Start<C>> {
        let mut chosen: Vec<&Start<C>> = before.into_iter().collect();
        match self.starts {
            Tried::None if before.is_some() => (),
            Tried::None | Tried::All => chosen.extend(starts),
            Tried::LastFirst => chosen.extend(starts.iter().rev()),
        }
        chosen
    }
}

/// Searches from each start in turn, as long as there is work left for the stage, and goes on from the highest end.
fn from_each<C: Covariance + Clone>(
    evidence: &mut impl Likelihood<C>,
    starts: &[&Start<C>],
    stage: &Stage,
) -> Vec<SearchEnd<C>> {
    let mut left = stage.work;
    let mut ends: Vec<SearchEnd<C>> = Vec::new();
    for start in starts {
        if start.distance != Distance::MoreSamples {
            left = left.min(stage.work_of_starts);
        }
        if left <= 0.0 && highest(&ends).is_some() {
            break;
        }
        let work = if left > 0.0 { left } else { MIN_WORK };
        let limits = stage.each.with_work(stage.each.max_work.min(work));
        let end = search(evidence, start, &limits);
        left -= end.report.work;
        ends.push(end);
    }
    let is_refined = |best: usize| starts[best].distance == Distance::MoreSamples;
    if let Some(best) = highest(&ends).filter(|&best| !is_refined(best)) {
        let StartReport {
            evaluations, work, ..
        } = ends[best].report;
        let limits = (stage
            .each
            .with_evaluations(stage.further.after(evaluations)))
        .with_work(left.min(stage.each.max_work - work));
        refine(evidence, &mut ends[best], &limits);
    }
    ends
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "bounds are taken over as they are")]
mod tests {
    use faer::Mat;
    use kernels::{Constant, SeArd};

    use super::*;
    use crate::evidence::{LikelihoodOptions, LogMarginal};

    #[test]
    fn a_reason_is_given_where_all_starts_have_the_same() {
        let failed = |failure: GpError| {
            let mut end = SearchEnd::at(Start::given(Constant::new(1.0).unwrap(), 0.1));
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
        let mut end = SearchEnd::at(Start::given(covariance, 0.1));
        end.raise_noise(&mut evidence);
        // ρ = 900, then about 1.
        assert!((end.noise_std - 3.0).abs() < 0.01, "{end:?}");
        assert_eq!(end.report.evaluations, 2);
        // −½ Σ t²/σ² − n ln σ − ½ n ln 2π at σ = 3.
        let expected = -10.0 - 20.0 * 3.0_f64.ln() - 10.0 * std::f64::consts::TAU.ln();
        assert!((end.report.log_marginal - expected).abs() < 1e-3);
    }

    #[test]
    fn noise_that_suits_stays() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let covariance = SeArd::new(3.0, vec![1.0]).unwrap();
        let mut end = SearchEnd::at(Start::given(covariance, 0.5));
        end.raise_noise(&mut evidence);
        assert_eq!((end.noise_std, end.report.evaluations), (0.5, 1));
    }

    #[test]
    fn noise_is_raised_to_where_rounding_allows_a_search() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let covariance = SeArd::new(1e6, vec![1.0]).unwrap();
        let mut end = SearchEnd::at(Start::given(covariance, 0.01));
        end.raise_noise(&mut evidence);
        let bound = evidence.rounding(&end.covariance, end.noise_std);
        assert!(bound <= 0.1, "{bound}");
        assert!(end.noise_std > 0.01);
    }
}
