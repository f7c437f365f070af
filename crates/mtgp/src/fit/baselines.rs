//! The models that learn nothing of how tasks are related: iGP and pGP.
//!
//! ```text
//! iGP   K^ρ = I: a process per task, with θ^x and σ shared
//! pGP   K^ρ = 11ᵀ: one process, to which the tasks are the same
//! ```
//! The likelihood of iGP is a sum over tasks, and that of pGP is GPc's of the pooled
//! data, so neither needs a covariance of several tasks while it is learned.
//! Source: sec. 4.6.

use faer::MatRef;
use gp_core::evidence::Evaluation;
use gp_core::search::{Distance, Found, Plan, Start, climb};
use gp_core::{GpError, Likelihood, LikelihoodOptions, LogMarginal, MethodUsed};
use kernels::TorqueCovariance;

use super::moments::moment_starts;
use super::options::MultiTaskOptions;
use super::parts::{part_for_step_1, smaller_parts};
use super::task_fit::TaskFit;
use crate::error::MtgpError;
use crate::prior::MultiTaskCovariance;
use crate::prior::Stacked;
use crate::prior::TaskCovariance;

/// Factor of the length scales of a start whose rank is too high, and how often it is applied.
const SMOOTHING: f64 = 2.0;
const MAX_SMOOTHINGS: usize = 6;

/// Learns pGP: one function for all tasks, whose differences count as noise.
///
/// # Shapes
/// `targets` (n,), N·m, in the order of the rows of `data`: see [`Stacked::stack`].
/// # Errors
/// [`MtgpError::CountMismatch`] unless there is one target per row; [`MtgpError::Gp`] for
/// fewer than 2 samples, targets that are not finite, columns that are not three per
/// joint, or no start with a finite likelihood.
/// # Source
/// Sec. 4.6; A.3, step 1 with K₀^ρ = 11ᵀ, from eq. (22) on the pooled data.
pub fn fit_pooled(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<TaskFit, MtgpError> {
    let mut starts = moment_starts(data, targets, options)?;
    let stage = |n_samples: usize| {
        let of_stage = options.briefly(n_samples).pooled_on(n_samples);
        of_stage.stage(n_samples)
    };
    // DEVIATION(A.3): the chapter searches on all samples from one start.
    let parts = smaller_parts(data, targets, options)?;
    let on_part = |idx: usize| {
        let (part, of_part): &(Stacked, Vec<f64>) = &parts[idx];
        LogMarginal::new(part.covariates(), of_part, options.likelihood)
    };
    let stages = parts.iter().map(|(_, of_part)| stage(of_part.len()));
    if let Ok(found) = climb(on_part, &starts, &Plan::in_stages(stages.collect())) {
        starts = vec![found.into_start().at(Distance::Near)];
    }
    let n_tasks = data.n_tasks();
    let plan = Plan::in_stages(vec![stage(targets.len())]);
    from_smooth_enough(starts, |starts| {
        let on_all = |_| LogMarginal::new(data.covariates(), targets, options.likelihood);
        let found = climb(on_all, starts, &plan)?;
        let task = TaskCovariance::Ones { n_tasks };
        with_task_matrix(data, targets, found, task, options)
    })
}

/// Learns from the starts, with length scales made longer where their rank is beyond the method.
///
/// What tasks differ by is no noise: it leaves pGP a rough function, whose rank grows with the
/// samples that show it.
fn from_smooth_enough<T>(
    mut starts: Vec<Start>,
    mut learn: impl FnMut(&[Start]) -> Result<T, MtgpError>,
) -> Result<T, MtgpError> {
    let mut outcome = learn(&starts);
    // DEVIATION(A.3): the chapter's start is that of eq. (22), whatever its rank.
    for _ in 0..MAX_SMOOTHINGS {
        if !outcome.as_ref().is_err_and(is_of_too_high_a_rank) {
            break;
        }
        for start in &mut starts {
            start.covariance = smoother(&start.covariance)?;
        }
        outcome = learn(&starts);
    }
    outcome
}

/// Whether no start could be evaluated for its rank, or the posterior has one too high.
///
/// The posterior chooses its pivots anew, and may need some more than the search did.
fn is_of_too_high_a_rank(error: &MtgpError) -> bool {
    let reason = match error {
        MtgpError::Gp(GpError::NoUsableStart { reason, .. }) => reason.as_deref(),
        MtgpError::Gp(error) => Some(error),
        _ => None,
    };
    matches!(reason, Some(GpError::RankTooHigh { .. }))
}

/// The covariance with longer length scales.
fn smoother(covariance: &TorqueCovariance) -> Result<TorqueCovariance, MtgpError> {
    let mut params = covariance.named_params();
    for length_scale in &mut params.length_scales {
        *length_scale *= SMOOTHING;
    }
    Ok(covariance.with_params(params)?)
}

/// Learns iGP: one function per task, all with the same hyperparameters.
///
/// Beyond 16,384 samples on some 2240 of them first, unless the starts are the chapter's.
/// # Shapes
/// As for [`fit_pooled`].
/// # Errors
/// As for [`fit_pooled`].
/// # Source
/// Sec. 4.6; A.3, step 1 with K₀^ρ = I, from eq. (22) on the pooled data; Minka & Picard 1997.
pub fn fit_independent(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<TaskFit, MtgpError> {
    let starts = moment_starts(data, targets, options)?;
    // DEVIATION(A.3): the chapter searches on all samples from one start.
    let part = part_for_step_1(data, targets, options)?;
    let (n_samples, likelihood) = (targets.len(), options.likelihood);
    let stages = match &part {
        Some((_, of_part)) => vec![
            options.stage(of_part.len()),
            options.on(n_samples).stage(n_samples),
        ],
        None => vec![options.stage(n_samples)],
    };
    let on = |stage: usize| match &part {
        Some((part, of_part)) if stage == 0 => SumOverTasks::new(part, of_part, likelihood),
        _ => SumOverTasks::new(data, targets, likelihood),
    };
    let found = climb(on, &starts, &Plan::in_stages(stages))?;
    let n_tasks = data.n_tasks();
    let task = TaskCovariance::Identity { n_tasks };
    with_task_matrix(data, targets, found, task, options)
}

/// Inputs and targets of each task.
fn by_task<'a>(
    data: &'a Stacked,
    targets: &'a [f64],
) -> impl Iterator<Item = (MatRef<'a, f64>, &'a [f64])> {
    let mut first = 0;
    data.counts().iter().map(move |&count| {
        let x = data.covariates().subrows(first, count);
        let t = &targets[first..first + count];
        first += count;
        (x, t)
    })
}

/// The winner of a search over (θ^x, σ), as the model of all tasks that it is.
fn with_task_matrix(
    data: &Stacked,
    targets: &[f64],
    found: Found<TorqueCovariance>,
    task: TaskCovariance,
    options: &MultiTaskOptions,
) -> Result<TaskFit, MtgpError> {
    let found = found.map(|input| MultiTaskCovariance::new(input, task));
    TaskFit::new(data, targets, found, options.likelihood)
}

/// Eq. (8) of tasks that are independent given θ^x and σ.
///
/// ```text
/// log p(t | X, θ) = Σ_γ log p(t^γ | X^γ, θ)
/// ```
struct SumOverTasks<'a> {
    parts: Vec<LogMarginal<'a>>,
    /// Gradient of one part.
    of_part: Vec<f64>,
}

impl<'a> SumOverTasks<'a> {
    fn new(data: &'a Stacked, targets: &'a [f64], options: LikelihoodOptions) -> Self {
        // The parts share the error that the whole may have.
        let options = LikelihoodOptions {
            certificate: options.certificate / data.n_tasks() as f64,
            ..options
        };
        Self {
            parts: by_task(data, targets)
                .map(|(x, t)| LogMarginal::new(x, t, options))
                .collect(),
            of_part: Vec::new(),
        }
    }
}

impl Likelihood<TorqueCovariance> for SumOverTasks<'_> {
    fn evaluate(
        &mut self,
        covariance: &TorqueCovariance,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError> {
        gradient.fill(0.0);
        let mut sum = Evaluation {
            log_marginal_likelihood: 0.0,
            error_bound: 0.0,
            method: MethodUsed::Certified,
            rank: 0,
        };
        for part in &mut self.parts {
            self.of_part.clear();
            self.of_part.resize(gradient.len(), 0.0);
            let of_task = part.evaluate(covariance, noise_std, &mut self.of_part)?;
            sum.log_marginal_likelihood += of_task.log_marginal_likelihood;
            sum.error_bound += of_task.error_bound;
            sum.rank += of_task.rank;
            if of_task.method == MethodUsed::Dense {
                sum.method = MethodUsed::Dense;
            }
            for (total, slope) in gradient.iter_mut().zip(&self.of_part) {
                *total += slope;
            }
        }
        Ok(sum)
    }

    fn parts(&self) -> Vec<MatRef<'_, f64>> {
        self.parts.iter().map(LogMarginal::x).collect()
    }
}

#[cfg(test)]
mod tests {
    use kernels::TorqueForm;

    use super::*;

    fn start() -> Start {
        Start::given(TorqueCovariance::unit(1, TorqueForm::Coulomb), 0.1)
    }

    fn failed(reason: GpError) -> MtgpError {
        let reason = Some(Box::new(reason));
        MtgpError::Gp(GpError::NoUsableStart {
            n_starts: 1,
            reason,
        })
    }

    fn too_high() -> GpError {
        GpError::RankTooHigh {
            n_samples: 20_000,
            largest: 2048,
        }
    }

    #[test]
    #[allow(clippy::float_cmp, reason = "doubling is exact")]
    fn length_scales_double_until_the_rank_is_affordable() {
        let mut tried = Vec::new();
        let found = from_smooth_enough(vec![start()], |starts| {
            let params = starts[0].covariance.named_params();
            assert_eq!((params.signal_std, starts[0].noise_std), (1.0, 0.1));
            tried.push(params.length_scales[2]);
            // First the search, then the posterior.
            match params.length_scales[2] {
                1.0 => Err(failed(too_high())),
                2.0 => Err(too_high().into()),
                _ => Ok(params.length_scales),
            }
        });
        assert_eq!(found.unwrap(), [4.0; 3]);
        assert_eq!(tried, [1.0, 2.0, 4.0]);
    }

    #[test]
    fn other_failures_and_ranks_that_stay_too_high_are_passed_on() {
        let not_finite = failed(GpError::NonFiniteLikelihood { n_samples: 3 });
        for (error, expected) in [(not_finite, 1), (failed(too_high()), 1 + MAX_SMOOTHINGS)] {
            let mut n_tried = 0;
            let found: Result<(), MtgpError> = from_smooth_enough(vec![start()], |_| {
                n_tried += 1;
                Err(error.clone())
            });
            assert_eq!(found, Err(error));
            assert_eq!(n_tried, expected);
        }
    }
}
