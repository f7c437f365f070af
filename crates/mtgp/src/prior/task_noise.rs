//! The prior of eq. (16) with a noise of its own for every task.
//!
//! Dividing the torques of each task by its noise leaves a model with unit noise shared by
//! all tasks, whose K^ρ is divided likewise:
//!
//! ```text
//! t′_a = t_a/σ_γ(a),   Λ′ = diag(1/σ) Λ,   K′ = S⁻¹KS⁻¹ with unit noise,   S = diag(σ_γ(a))
//! log p(t) = log p′(t′) − Σ_γ n_γ log σ_γ
//! ```

use faer::Mat;
use gp_core::evidence::{Evaluation, Evidence};
use gp_core::{LikelihoodOptions, LogMarginal};
use kernels::Covariance;

use crate::error::{MtgpError, require_count};
use crate::prior::layout::Stacked;
use crate::prior::multi_task_covariance::MultiTaskCovariance;
use crate::prior::task_cov::{TaskCovariance, TaskFactor};
use crate::prior::task_matrix::TaskMatrix;

/// A multi-task prior whose tasks are observed with noise of different sizes.
///
/// θ is that of the prior, followed by the m standard deviations σ_γ.
/// # Source
/// Eq. (16) with the noise of Bonilla, Chai & Williams 2008, sec. 2.1.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskNoise {
    prior: MultiTaskCovariance,
    task_noise_std: Vec<f64>,
}

impl TaskNoise {
    /// The prior with the noise standard deviation of each task, in target units.
    ///
    /// A K^ρ of descriptors is taken as its factor Λ from here on.
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless there is one per task;
    /// [`MtgpError::Kernel`] for one that is not finite and above zero.
    pub fn new(prior: MultiTaskCovariance, task_noise_std: Vec<f64>) -> Result<Self, MtgpError> {
        let what = "noise standard deviations of tasks";
        require_count(what, task_noise_std.len(), prior.n_tasks())?;
        let is_bad = |value: &f64| !(value.is_finite() && *value > 0.0);
        match task_noise_std.iter().position(is_bad) {
            None => Ok(Self {
                prior: with_factor(prior)?,
                task_noise_std,
            }),
            Some(task) => Err(MtgpError::Kernel(kernels::KernelError::NotPositive {
                name: format!("task_noise_std[{task}]"),
                value: task_noise_std[task],
            })),
        }
    }

    /// Log marginal likelihood and its gradient.
    ///
    /// The gradient is in the order of θ: θ^x, the free entries of Λ, σ_γ by task.
    /// ```text
    /// ∂/∂Λ_γc = (∂/∂Λ′_γc)/σ_γ
    /// ∂/∂σ_γ  = (Σ_a α′_a t′_a − Σ_c Λ′_γc ∂/∂Λ′_γc − n_γ)/σ_γ      a over the samples of task γ
    /// ```
    /// # Shapes
    /// `targets` (n,), in the order of the rows of `data`.
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless the tasks and targets of `data` fit;
    /// [`MtgpError::NonFinite`] for a target; [`MtgpError::Gp`] where the likelihood
    /// has no value.
    /// # Panics
    /// If the inputs of `data` do not have the number of columns that the prior needs.
    pub fn evidence(
        &self,
        data: &Stacked,
        targets: &[f64],
        options: LikelihoodOptions,
    ) -> Result<Evidence, MtgpError> {
        let white_targets = self.white_targets(data, targets)?;
        let white = self.white_prior()?;
        let mut slopes = vec![0.0; white.n_params() + 1];
        let mut marginal = LogMarginal::new(data.inputs(), &white_targets, options);
        let of_white = marginal.evaluate(&white, 1.0, &mut slopes)?;

        let n_input = self.prior.input().n_params();
        let of_factor = &slopes[n_input..slopes.len() - 1];
        let mut gradient = slopes[..n_input].to_vec();
        if self.prior.task().n_params() > 0 {
            let tasks = factor_of(self.prior.task())?.entry_tasks();
            let scaled = of_factor.iter().zip(tasks);
            gradient.extend(scaled.map(|(slope, task)| slope / self.task_noise_std[task]));
        }
        let products = (marginal.alpha().iter().zip(&white_targets)).map(|(a, t)| a * t);
        gradient.extend(self.noise_slopes(data, white.task(), of_factor, products)?);

        let log_noise = (data.counts().iter().zip(&self.task_noise_std))
            .map(|(count, noise_std)| *count as f64 * noise_std.ln());
        let log_marginal_likelihood = of_white.log_marginal_likelihood - log_noise.sum::<f64>();
        Ok(Evidence {
            evaluation: Evaluation {
                log_marginal_likelihood,
                ..of_white
            },
            gradient,
        })
    }

    /// t′, (n,).
    fn white_targets(&self, data: &Stacked, targets: &[f64]) -> Result<Vec<f64>, MtgpError> {
        require_count("tasks", data.n_tasks(), self.prior.n_tasks())?;
        require_count("targets", targets.len(), data.tasks().len())?;
        if let Some(row) = targets.iter().position(|target| !target.is_finite()) {
            return Err(MtgpError::NonFinite {
                what: "target",
                row,
                column: 0,
                value: targets[row],
            });
        }
        let noise_of_rows = data.tasks().iter().map(|&task| self.task_noise_std[task]);
        Ok(targets
            .iter()
            .zip(noise_of_rows)
            .map(|(t, s)| t / s)
            .collect())
    }

    /// c^x with K^ρ′ = Λ′Λ′ᵀ.
    fn white_prior(&self) -> Result<MultiTaskCovariance, MtgpError> {
        let factor = factor_of(self.prior.task())?;
        let lambda = factor.lambda();
        let white = Mat::from_fn(lambda.nrows(), lambda.ncols(), |row, col| {
            lambda[(row, col)] / self.task_noise_std[row]
        });
        let task = TaskCovariance::Factor(TaskFactor::new(white)?);
        Ok(MultiTaskCovariance::new(self.prior.input().clone(), task))
    }

    /// ∂/∂σ_γ of the likelihood, by task.
    ///
    /// `of_factor` holds ∂/∂Λ′ and `products` α′_a t′_a.
    fn noise_slopes(
        &self,
        data: &Stacked,
        white: &TaskCovariance,
        of_factor: &[f64],
        products: impl Iterator<Item = f64>,
    ) -> Result<Vec<f64>, MtgpError> {
        let mut slopes: Vec<f64> = data.counts().iter().map(|&count| -(count as f64)).collect();
        for (task, product) in data.tasks().iter().zip(products) {
            slopes[*task] += product;
        }
        let factor = factor_of(white)?;
        let entries = factor.entries();
        for ((task, entry), slope) in factor.entry_tasks().zip(entries).zip(of_factor) {
            slopes[task] -= entry * slope;
        }
        for (slope, noise_std) in slopes.iter_mut().zip(&self.task_noise_std) {
            *slope /= noise_std;
        }
        Ok(slopes)
    }
}

/// The prior with Λ in the place of descriptors.
fn with_factor(prior: MultiTaskCovariance) -> Result<MultiTaskCovariance, MtgpError> {
    let TaskCovariance::Described(_) = prior.task() else {
        return Ok(prior);
    };
    let task = TaskCovariance::Factor(factor_of(prior.task())?);
    Ok(MultiTaskCovariance::new(prior.input().clone(), task))
}

/// Λ of any kind of K^ρ: I and 1 for the fixed kinds.
fn factor_of(task: &TaskCovariance) -> Result<TaskFactor, MtgpError> {
    match task {
        TaskCovariance::Factor(factor) => Ok(factor.clone()),
        _ => TaskFactor::new(task.root()),
    }
}
