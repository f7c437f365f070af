//! A joint's torque under several loads, learned: options, result and report.

use faer::{Mat, MatRef};
use gp_core::{
    GpError, LikelihoodOptions, MethodUsed, Posterior, Prediction, StartKind, StartReport, Starts,
};
use kernels::TorqueForm;

use crate::climb::Climb;
use crate::error::MtgpError;
use crate::prior::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, TaskMatrix};
use crate::rank_part::RankPart;

/// How long and how hard to search, and how far to follow the chapter.
#[derive(Debug, Clone, PartialEq)]
pub struct MultiTaskOptions {
    /// Terms of c^x.
    pub form: TorqueForm,
    /// Starts of the pooled and the independent model.
    pub starts: Starts,
    /// Likelihoods with gradient that each search may use.
    pub max_evaluations: usize,
    /// Floating-point operations, n³ for each likelihood, after which a search for Λ
    /// ends sooner than that, though not before 80 likelihoods; 24 beyond 16,384 samples.
    pub max_flops: f64,
    /// Those that each of several starts gets before all but the highest are left.
    pub screening: usize,
    /// Converged when no component of the projected gradient with respect to the
    /// logarithms of the hyperparameters is larger, in nats.
    pub gradient_tolerance: f64,
    /// Stalled when an iteration gains less than this, in nats.
    pub value_tolerance: f64,
    /// How each likelihood is computed.
    pub likelihood: LikelihoodOptions,
    /// How the rank-r part of eq. (28) is taken.
    pub rank_part: RankPart,
}

impl MultiTaskOptions {
    /// A.3 as it stands: eq. (22) alone, with up to 300 evaluations per search.
    pub fn chapter() -> Self {
        Self {
            form: TorqueForm::Coulomb,
            starts: Starts::Chapter,
            max_evaluations: 300,
            max_flops: f64::INFINITY,
            screening: 300,
            gradient_tolerance: 1e-3,
            value_tolerance: 1e-5,
            likelihood: LikelihoodOptions::automatic(),
            rank_part: RankPart::Eigenpairs,
        }
    }

    /// Several starts, of which the highest after 30 evaluations goes on, to up to 2000.
    ///
    /// Many of them are needed: from rank 2 to rank 4 a search may take all.
    /// They are had cheaply on few data, from where a search on more data may set out.
    pub fn several() -> Self {
        Self {
            starts: Starts::Several,
            screening: 30,
            max_evaluations: 2000,
            max_flops: 8e10,
            ..Self::chapter()
        }
    }
}

/// Likelihoods that a search may compute up to `MANY_SAMPLES`, and beyond.
const FEWEST_EVALUATIONS: usize = 80;
const FEWEST_ON_MANY: usize = 24;

/// Likelihoods of pGP beyond `MANY_SAMPLES`: its rank is near the largest, several times that of the others.
const POOLED_ON_MANY: usize = 4;

/// Samples of all tasks together beyond which step 1 sees a part of them, and the search on all only
/// adjusts what was found on that part: as many as a likelihood by the dense path takes.
pub(crate) const MANY_SAMPLES: usize = 16_384;

/// Evaluations from which several starts are searched for a while before one is chosen;
/// with fewer, their first likelihoods decide.
const ENOUGH_TO_COMPARE: usize = 200;

/// Part of the evaluations that a search gets that is not to go to the end.
const BRIEF_PART: usize = 3;

impl MultiTaskOptions {
    /// The same options with the evaluations that `max_flops` leaves on n samples.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "between two counts"
    )]
    pub(crate) fn on(&self, n_samples: usize) -> Self {
        let affordable = self.max_flops / (n_samples as f64).powi(3);
        let fewest = if n_samples > MANY_SAMPLES {
            FEWEST_ON_MANY
        } else {
            FEWEST_EVALUATIONS
        };
        let fewest = fewest.min(self.max_evaluations);
        let most = self.max_evaluations as f64;
        let max_evaluations = affordable.clamp(fewest as f64, most) as usize;
        Self {
            max_evaluations,
            screening: if max_evaluations < ENOUGH_TO_COMPARE {
                1
            } else {
                self.screening
            },
            ..self.clone()
        }
    }

    /// The same options for pGP on n samples.
    ///
    /// With [`Starts::Chapter`] as for any search.
    pub(crate) fn pooled_on(&self, n_samples: usize) -> Self {
        let mut options = self.on(n_samples);
        if self.starts == Starts::Several && n_samples > MANY_SAMPLES {
            options.max_evaluations = options.max_evaluations.min(POOLED_ON_MANY);
        }
        options
    }

    /// The same options for a search on n samples that is not to go to the end.
    ///
    /// With [`Starts::Chapter`] every search goes to the end.
    pub(crate) fn briefly(&self, n_samples: usize) -> Self {
        if self.starts == Starts::Chapter {
            return self.clone();
        }
        let of_whole = self.on(n_samples).max_evaluations;
        Self {
            max_evaluations: of_whole.div_ceil(BRIEF_PART),
            ..self.clone()
        }
    }
}

/// Where the hyperparameters of a start are from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// The moments of the pooled data, eq. (22) or a variation of it.
    Moments(StartKind),
    /// A.3, from the pooled model (K₀^ρ = 11ᵀ) and eq. (28).
    Pooled,
    /// A.3, from the independent model (K₀^ρ = I) and eq. (28).
    Independent,
    /// A fit of a lower rank to the same data, with new columns of Λ.
    LowerRank,
    /// A fit of the same or a higher rank, such as one to fewer data.
    Given,
}

/// What one start led to.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskStart {
    /// Which start.
    pub origin: Origin,
    /// Its likelihoods, evaluations and end.
    pub report: StartReport,
}

/// How a fit was found and what help it needed.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskFitReport {
    /// Log marginal likelihood of the fit, natural log, summed over the data.
    pub log_marginal: f64,
    /// Every start, in the order tried.
    pub starts: Vec<TaskStart>,
    /// Index in `starts` of the one that won.
    pub winner: usize,
    /// Hyperparameters that ended on a bound, by name.
    pub bounds_hit: Vec<String>,
    /// How the matrix of the fit was factorised.
    pub method: MethodUsed,
    /// Rank of that factor: the number of samples if dense.
    pub factor_rank: usize,
    /// Bound on the error of the log marginal likelihood at the hyperparameters found, in nats.
    pub error_bound: f64,
    /// A lower bound on the condition number of K + σ²I.
    pub condition_lower_bound: f64,
}

impl TaskFitReport {
    /// The start that won.
    pub fn winning_start(&self) -> &TaskStart {
        &self.starts[self.winner]
    }

    /// Where the start that won is from.
    pub fn origin(&self) -> Origin {
        self.winning_start().origin
    }

    /// Evaluations of all starts together.
    pub fn evaluations(&self) -> usize {
        self.starts
            .iter()
            .map(|start| start.report.evaluations)
            .sum()
    }
}

/// A joint's torque in every task, learned.
#[derive(Debug, Clone)]
pub struct TaskFit {
    /// The process with the hyperparameters found, conditioned on the data.
    pub posterior: Posterior<MultiTaskCovariance>,
    /// How the hyperparameters were found.
    pub report: TaskFitReport,
}

impl TaskFit {
    /// Conditions on the data at the end of a search.
    pub(crate) fn new(
        data: &Stacked,
        targets: &[f64],
        climb: Climb<MultiTaskCovariance>,
        likelihood: LikelihoodOptions,
    ) -> Result<Self, MtgpError> {
        let (posterior, error_bound) = Posterior::with_error_bound(
            climb.covariance,
            climb.noise_std,
            data.inputs(),
            targets,
            likelihood,
        )?;
        let report = TaskFitReport {
            log_marginal: climb.starts[climb.winner].report.log_marginal,
            starts: climb.starts,
            winner: climb.winner,
            bounds_hit: climb.bounds_hit,
            method: posterior.method(),
            factor_rank: posterior.rank(),
            error_bound,
            condition_lower_bound: posterior.condition_lower_bound(),
        };
        Ok(Self { posterior, report })
    }

    /// The covariance with the hyperparameters found.
    pub fn covariance(&self) -> &MultiTaskCovariance {
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

    /// K^ρ, (m, m).
    pub fn k_task(&self) -> Mat<f64> {
        self.covariance().task().k_task()
    }

    /// Λ, (m, r); `None` where K^ρ is fixed.
    pub fn lambda(&self) -> Option<MatRef<'_, f64>> {
        self.task_factor().map(TaskFactor::lambda)
    }

    pub(crate) fn task_factor(&self) -> Option<&TaskFactor> {
        match self.covariance().task() {
            TaskCovariance::Factor(factor) => Some(factor),
            _ => None,
        }
    }

    /// Posterior means and latent variances of one task.
    ///
    /// # Shapes
    /// `x` (k, 3ℓ).
    /// # Errors
    /// [`MtgpError::UnknownTask`]; [`MtgpError::Gp`] for inputs that are not finite or
    /// have another number of columns.
    pub fn predict(&self, task: usize, x: MatRef<'_, f64>) -> Result<Prediction, MtgpError> {
        let rows = self.rows_of(task, x)?;
        Ok(self.posterior.predict(rows.as_ref())?)
    }

    /// Posterior means of one task, in target units.
    ///
    /// # Errors
    /// As for [`TaskFit::predict`].
    pub fn predict_mean(&self, task: usize, x: MatRef<'_, f64>) -> Result<Vec<f64>, MtgpError> {
        let rows = self.rows_of(task, x)?;
        Ok(self.posterior.predict_mean(rows.as_ref())?)
    }

    pub(crate) fn rows_of(&self, task: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, MtgpError> {
        let expected = self.covariance().input().linear().linear_std().len();
        if x.ncols() != expected {
            let found = x.ncols();
            return Err(GpError::WrongCovariates { found, expected }.into());
        }
        self.covariance().rows_of(x, task)
    }
}

#[cfg(test)]
mod tests {
    use super::MultiTaskOptions;

    #[test]
    fn more_samples_leave_fewer_evaluations() {
        let options = MultiTaskOptions::several();
        let evaluations = |n_samples| options.on(n_samples).max_evaluations;
        assert_eq!(evaluations(280), 2000);
        assert_eq!([1820, 16_384].map(evaluations), [80, 80]);
        assert_eq!(evaluations(56_000), 24);
        assert_eq!(MultiTaskOptions::chapter().on(56_000).max_evaluations, 300);
    }
}
