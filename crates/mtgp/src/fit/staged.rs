//! Learning a multi-task model in stages, A.3.
//!
//! ```text
//! 1  from (θ₀^x, σ₀²) of eq. (22): maximise over (θ^x, σ²) with K^ρ = 11ᵀ and with K^ρ = I;
//!    the higher one gives θ₁^x
//! 2  K₁^ρ = the rank-r part of eq. (28) by the model of step 1
//! 3  from (θ₁^x, K₁^ρ, σ₀²): maximise over all of (θ^x, K^ρ, σ²)
//! ```
//! The two models of step 1 are pGP and iGP themselves.

use faer::{Mat, MatRef};
use gp_core::search::{Distance, Origin, Plan, Start, climb};
use gp_core::{LogMarginal, Starts};

use super::augmented_targets::{augmented_k_task, augmented_targets};
use super::baselines::{fit_independent, fit_pooled};
use super::moments::pooled_moments;
use super::options::MultiTaskOptions;
use super::parts::{part_for_step_1, require_targets};
use super::task_fit::TaskFit;
use crate::error::{MtgpError, require_count};
use crate::prior::MultiTaskCovariance;
use crate::prior::Stacked;
use crate::prior::rank_part;
use crate::prior::{TaskCovariance, TaskFactor};

/// Part of the mean diagonal of K^ρ that a new column of Λ adds to its trace.
const NEW_COLUMN: f64 = 1e-6;

/// A column of Λ below this part of the root mean diagonal of K^ρ is taken for zero.
const ZERO_COLUMN: f64 = 1e-6;

/// What the ranks of one joint set out from: steps 1 and 2 of A.3.
#[derive(Debug, Clone)]
pub struct StageOne {
    /// pGP.
    pub pooled: TaskFit,
    /// iGP.
    pub independent: TaskFit,
    /// K^ρ_aug of eq. (28), (m, m).
    pub k_aug: Mat<f64>,
    /// σ₀ of eq. (22), from which step 3 starts again.
    pub initial_noise_std: f64,
}

impl StageOne {
    /// Learns pGP and iGP, and estimates K^ρ by the higher one.
    ///
    /// Beyond 16,384 samples from some 2240 of them, unless the starts are the chapter's.
    /// # Shapes
    /// `targets` (n,), N·m, in the order of the rows of `data`: see [`Stacked::stack`].
    /// # Errors
    /// As for [`fit_pooled`].
    pub fn new(
        data: &Stacked,
        targets: &[f64],
        options: &MultiTaskOptions,
    ) -> Result<Self, MtgpError> {
        // DEVIATION(A.3): the chapter's step 1 sees all samples.
        if let Some((part, of_part)) = part_for_step_1(data, targets, options)? {
            return Self::new(&part, &of_part, options);
        }
        let pooled = fit_pooled(data, targets, options)?;
        let independent = fit_independent(data, targets, options)?;
        Self::from_fits(data, targets, pooled, independent, options)
    }

    /// Step 2 after pGP and iGP of the same data.
    ///
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless there is one target per row;
    /// [`MtgpError::Gp`] for targets that are not finite.
    pub fn from_fits(
        data: &Stacked,
        targets: &[f64],
        pooled: TaskFit,
        independent: TaskFit,
        options: &MultiTaskOptions,
    ) -> Result<Self, MtgpError> {
        let initial_noise_std = pooled_moments(data, targets, options)?.noise_std;
        let mut stage_one = Self {
            pooled,
            independent,
            k_aug: Mat::new(),
            initial_noise_std,
        };
        let augmented = augmented_targets(data, targets, stage_one.winner())?;
        let input = stage_one.winner().covariance().input();
        stage_one.k_aug = augmented_k_task(input, &augmented, options.likelihood)?;
        Ok(stage_one)
    }

    /// Which model has the higher likelihood; pGP of equals, as the simpler one.
    pub fn origin(&self) -> Origin {
        if self.independent.log_marginal() > self.pooled.log_marginal() {
            Origin::Independent
        } else {
            Origin::Pooled
        }
    }

    /// The model with the higher likelihood.
    pub fn winner(&self) -> &TaskFit {
        if self.origin() == Origin::Independent {
            &self.independent
        } else {
            &self.pooled
        }
    }
}

/// Learns mGP of a given rank: step 3 of A.3, and from another fit if there is one.
///
/// As [`fit_rank_from`] with one fit or none.
/// # Errors
/// As for [`fit_rank_from`].
/// # Source
/// A.3, steps 2 and 3.
pub fn fit_rank(
    data: &Stacked,
    targets: &[f64],
    rank: usize,
    stage_one: &StageOne,
    warm: Option<&TaskFit>,
    options: &MultiTaskOptions,
) -> Result<TaskFit, MtgpError> {
    fit_rank_from(data, targets, rank, stage_one, warm.as_slice(), options)
}

/// Learns mGP of a given rank from the chapter's start and from other fits.
///
/// `warm` are fits of the same tasks, of other ranks or to fewer data.
/// With one of at least this rank, the chapter's start is left out: such a fit is
/// where that start led before.
/// Where pGP won stage 1 and beats all of `warm`, it is itself a start, of rank 1.
/// Several starts get `options.screening` evaluations each, and the highest goes on.
/// Such fits are near an optimum, and refined from the first evaluation: see [`gp_core::search::refine`].
/// [`Starts::Chapter`] without `warm` is A.3 as it stands.
/// # Shapes
/// `targets` (n,), N·m, in the order of the rows of `data`.
/// # Errors
/// [`MtgpError::BadRank`] for a rank of 0 or above m; [`MtgpError::CountMismatch`] unless
/// there is one target per row, and as many tasks in `stage_one` and `warm` as in `data`;
/// [`MtgpError::Gp`] if no start has a finite likelihood.
/// # Source
/// A.3, steps 2 and 3.
pub fn fit_rank_from(
    data: &Stacked,
    targets: &[f64],
    rank: usize,
    stage_one: &StageOne,
    warm: &[&TaskFit],
    options: &MultiTaskOptions,
) -> Result<TaskFit, MtgpError> {
    require_targets(data, targets)?;
    require_tasks(data, stage_one.winner())?;
    let mut starts = vec![chapter_stage_three(stage_one, rank, options)?];
    // DEVIATION(A.3): starts beside the chapter's; the report says which one won.
    for fit in warm {
        require_tasks(data, fit)?;
        starts.push(warm_start(fit, stage_one.k_aug.as_ref(), rank, options)?);
    }
    if starts.iter().any(|start| start.origin == Origin::Given) {
        starts.remove(0);
    }
    if options.starts == Starts::Several && is_pooled_best(stage_one, warm) {
        let pooled = &stage_one.pooled;
        let start = warm_start(pooled, stage_one.k_aug.as_ref(), rank, options)?;
        starts.push(start);
    }

    let n_samples = targets.len();
    let plan = Plan::in_stages(vec![options.on(n_samples).stage(n_samples)]);
    let on_all = |_| LogMarginal::new(data.inputs(), targets, options.likelihood);
    let found = climb(on_all, &starts, &plan)?;
    TaskFit::new(data, targets, found, options.likelihood)
}

/// Whether pGP, which every rank contains, is above iGP and all other fits.
fn is_pooled_best(stage_one: &StageOne, warm: &[&TaskFit]) -> bool {
    let pooled = stage_one.pooled.log_marginal();
    let is_beaten = warm.iter().any(|fit| fit.log_marginal() > pooled);
    stage_one.origin() == Origin::Pooled && !is_beaten
}

fn require_tasks(data: &Stacked, fit: &TaskFit) -> Result<(), MtgpError> {
    let n_tasks = fit.covariance().n_tasks();
    require_count("tasks of a fit to start from", n_tasks, data.n_tasks())
}

/// (θ₁^x, K₁^ρ, σ₀).
fn chapter_stage_three(
    stage_one: &StageOne,
    rank: usize,
    options: &MultiTaskOptions,
) -> Result<Start<MultiTaskCovariance>, MtgpError> {
    let part = rank_part(stage_one.k_aug.as_ref(), rank, options.rank_part)?;
    let factor = without_zero_columns(&part)?;
    let input = stage_one.winner().covariance().input().clone();
    Ok(Start::new(
        stage_one.origin(),
        MultiTaskCovariance::new(input, TaskCovariance::Factor(factor)),
        stage_one.initial_noise_std,
    ))
}

/// Λ with a small entry on the diagonal of every column that is zero.
///
/// The likelihood is stationary in a column of zeros, so a search would never leave it.
fn without_zero_columns(factor: &TaskFactor) -> Result<TaskFactor, MtgpError> {
    let mut lambda = factor.lambda().to_owned();
    let mean_diagonal = lambda.squared_norm_l2() / lambda.nrows() as f64;
    let size = if mean_diagonal > 0.0 {
        mean_diagonal.sqrt()
    } else {
        1.0
    };
    for col in 0..lambda.ncols() {
        // DEVIATION(A.3): eq. (28) may have a lower rank than is asked for.
        if lambda.col(col).norm_l2() <= ZERO_COLUMN * size {
            lambda[(col, col)] = NEW_COLUMN.sqrt() * size;
        }
    }
    TaskFactor::new(lambda)
}

/// All of an earlier fit, with its K^ρ taken to the rank asked for.
fn warm_start(
    fit: &TaskFit,
    k_aug: MatRef<'_, f64>,
    rank: usize,
    options: &MultiTaskOptions,
) -> Result<Start<MultiTaskCovariance>, MtgpError> {
    let task = fit.covariance().task();
    if fit
        .task_factor()
        .is_some_and(|factor| factor.rank() == rank)
    {
        return Ok(fit.start());
    }
    let k_task = fit.k_task();
    let (origin, factor) = if task.rank() < rank {
        let known = rank_part(k_task.as_ref(), task.rank(), options.rank_part)?;
        (Origin::LowerRank, with_new_columns(&known, k_aug, rank)?)
    } else {
        let part = rank_part(k_task.as_ref(), rank, options.rank_part)?;
        (Origin::Given, part)
    };
    let input = fit.covariance().input().clone();
    let task = TaskCovariance::Factor(without_zero_columns(&factor)?);
    let covariance = MultiTaskCovariance::new(input, task);
    Ok(Start::new(origin, covariance, fit.noise_std()).at(Distance::Near))
}

/// Λ with further columns, small, along what eq. (28) has beyond it.
///
/// ```text
/// [Λ  c V],   V the top eigenvectors of P K_aug P,   P = I − Λ(ΛᵀΛ)⁻¹Λᵀ
/// ```
/// rotated back to a truncated lower-triangular matrix.
fn with_new_columns(
    factor: &TaskFactor,
    k_aug: MatRef<'_, f64>,
    rank: usize,
) -> Result<TaskFactor, MtgpError> {
    let (n_tasks, known) = (factor.n_tasks(), factor.rank());
    let lambda = factor.lambda();
    let q = lambda.qr().compute_thin_Q(); // (m, known)
    let p = Mat::<f64>::identity(n_tasks, n_tasks) - &q * q.transpose();
    // Directions within Λ have eigenvalue −1, below all others.
    let unseen = &p * k_aug * &p / k_aug.norm_max().max(f64::MIN_POSITIVE);
    let outside = unseen - &q * q.transpose();
    let eigen =
        outside
            .self_adjoint_eigen(faer::Side::Lower)
            .map_err(|_| MtgpError::NonFinite {
                what: "task matrix of eq. (28)",
                row: 0,
                column: 0,
                value: k_aug[(0, 0)],
            })?;
    let mean_diagonal = lambda.squared_norm_l2() / n_tasks as f64;
    let size = (NEW_COLUMN * mean_diagonal).sqrt();
    TaskFactor::from_root(
        Mat::from_fn(n_tasks, rank, |row, col| {
            if col < known {
                lambda[(row, col)]
            } else {
                size * eigen.U()[(row, n_tasks - 1 - (col - known))]
            }
        })
        .as_ref(),
    )
}
