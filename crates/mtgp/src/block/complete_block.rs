//! A complete block design: every context observed at the same inputs, eq. (17), and its likelihood for a fit.

use faer::{Mat, MatRef};
use gp_core::data::require_finite_inputs;
use gp_core::evidence::Evaluation;
use gp_core::{GpError, Likelihood, MethodUsed};
use kernels::{Covariance, TorqueCovariance};

use crate::block::posterior::BlockPosterior;
use crate::error::MtgpError;
use crate::prior::{MultiTaskCovariance, TaskMatrix, with_every_task};

/// The torques of every context at the same inputs.
///
/// Being a [`Likelihood`] of the prior of eq. (16), it is something that [`gp_core::search::search`] and
/// [`gp_core::search::refine`] climb: the maximum is that of [`gp_core::LogMarginal`] on the same samples, at
/// O(ν³ + m³ + mν(m + ν)) operations an evaluation instead of (mν)³/3.
///
/// ```
/// use faer::{Mat, mat};
/// use gp_core::FitOptions;
/// use gp_core::search::{Start, refine, search};
/// use kernels::{TorqueCovariance, TorqueForm};
/// use mtgp::block::CompleteBlock;
/// use mtgp::{MultiTaskCovariance, TaskCovariance, TaskFactor};
///
/// // One joint at eight states under two loads, the second load twice the first.
/// let x = Mat::from_fn(8, 3, |j, col| (0.7 * j as f64 + 1.9 * col as f64).sin());
/// let torque = |j: usize| 3.0 * x[(j, 0)] + x[(j, 1)] * x[(j, 2)];
/// let targets = Mat::from_fn(8, 2, |j, task| torque(j) * (1.0 + task as f64));
/// let mut block = CompleteBlock::new(x.as_ref(), targets.as_ref())?;
///
/// let task = TaskCovariance::Factor(TaskFactor::from_entries(2, 1, &[1.0, 1.0])?);
/// let start = MultiTaskCovariance::new(TorqueCovariance::unit(1, TorqueForm::Smooth), task);
/// let limits = FitOptions { max_evaluations: 40, ..FitOptions::chapter() }.limits();
/// let mut end = search(&mut block, &Start::given(start, 0.5), &limits);
/// refine(&mut block, &mut end, &limits);
///
/// let fitted = block.posterior(&end.covariance, end.noise_std)?;
/// let [first, second] = [0, 1].map(|task| fitted.predict(task, mat![[0.2, 0.1, 0.3]].as_ref()));
/// assert!((second?.mean[0] / first?.mean[0] - 2.0).abs() < 1e-3);
/// # Ok::<(), mtgp::MtgpError>(())
/// ```
/// # Source
/// Eq. (17).
#[derive(Debug, Clone)]
pub struct CompleteBlock {
    /// (ν, d).
    x: Mat<f64>,
    /// T, (ν, m).
    targets: Mat<f64>,
    /// The samples as rows (x, task), (mν, d + 1).
    rows: Mat<f64>,
}

impl CompleteBlock {
    /// Keeps the torques of every context at the same inputs.
    ///
    /// # Shapes
    /// `x` (ν, d); `targets` T (ν, m).
    /// # Errors
    /// [`GpError`] for data that is missing or not finite.
    /// # Panics
    /// If there is not one row of targets per input.
    pub fn new(x: MatRef<'_, f64>, targets: MatRef<'_, f64>) -> Result<Self, MtgpError> {
        require_block(x, targets)?;
        Ok(Self {
            x: x.to_owned(),
            targets: targets.to_owned(),
            rows: with_every_task(x, targets.ncols()),
        })
    }

    /// Number of tasks m.
    pub fn n_tasks(&self) -> usize {
        self.targets.ncols()
    }

    /// Number of inputs ν.
    pub fn n_inputs(&self) -> usize {
        self.x.nrows()
    }

    /// The process with the prior of eq. (16) and noise that all tasks share, conditioned on the block.
    ///
    /// # Errors
    /// As for [`CompleteBlock::condition`].
    /// # Panics
    /// As for [`CompleteBlock::condition`].
    pub fn posterior<T: TaskMatrix>(
        &self,
        prior: &MultiTaskCovariance<T>,
        noise_std: f64,
    ) -> Result<BlockPosterior<'_, TorqueCovariance>, MtgpError> {
        let noise_std = vec![noise_std; self.n_tasks()];
        let k_task = prior.task().k_task();
        self.condition(prior.input().clone(), k_task.as_ref(), &noise_std)
    }

    /// The process with any c^x and K^ρ and a noise for every task, conditioned on the block.
    ///
    /// # Shapes
    /// `k_task` K^ρ (m, m), read from its lower triangle, of any rank; `noise_std` σ (m,), the same
    /// number m times for noise that is shared.
    /// # Errors
    /// [`GpError::BadNoise`] for a σ that is not positive; [`MtgpError::NoSpectrum`] for a covariance that
    /// is not finite.
    /// # Panics
    /// If shapes do not agree, or the block's inputs do not have the columns that the covariance needs.
    pub fn condition<C: Covariance>(
        &self,
        covariance: C,
        k_task: MatRef<'_, f64>,
        noise_std: &[f64],
    ) -> Result<BlockPosterior<'_, C>, MtgpError> {
        let (x, targets) = (self.x.as_ref(), self.targets.as_ref());
        BlockPosterior::new(covariance, k_task, noise_std, x, targets)
    }
}

/// Nothing is left out, so the evaluation is one of the dense path, of rank mν.
impl<T: TaskMatrix> Likelihood<MultiTaskCovariance<T>> for CompleteBlock {
    /// # Errors
    /// [`GpError::BadNoise`]; [`GpError::NonFiniteLikelihood`] where the value or its gradient overflows.
    /// # Panics
    /// If the prior is for another number of tasks, or `gradient` does not have one entry per
    /// hyperparameter and one for σ.
    fn evaluate(
        &mut self,
        covariance: &MultiTaskCovariance<T>,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError> {
        let n_samples = self.rows.nrows();
        let overflow = || GpError::NonFiniteLikelihood { n_samples };
        let of_search = |error| match error {
            MtgpError::Gp(error) => error,
            _ => overflow(),
        };
        let process = (self.posterior(covariance, noise_std)).map_err(of_search)?;
        let log_marginal_likelihood = process.log_marginal_likelihood().map_err(of_search)?;

        let slopes = process.gradient();
        assert_eq!(gradient.len(), covariance.n_params() + 1);
        let (of_input, rest) = gradient.split_at_mut(slopes.theta.len());
        let (of_noise, of_task) = rest.split_last_mut().expect("σ is the last");
        of_input.copy_from_slice(&slopes.theta);
        of_task.fill(0.0);
        (covariance.task()).add_adjoint(slopes.k_task.as_ref(), of_task);
        *of_noise = slopes.noise_std.iter().sum();
        if !gradient.iter().sum::<f64>().is_finite() {
            return Err(overflow());
        }
        Ok(Evaluation {
            log_marginal_likelihood,
            error_bound: process.rounding(),
            method: MethodUsed::Dense,
            rank: n_samples,
        })
    }

    fn parts(&self) -> Vec<MatRef<'_, f64>> {
        vec![self.rows.as_ref()]
    }
}

/// Fails on data that is missing or not finite.
///
/// # Panics
/// If there is not one row of targets per input.
pub(crate) fn require_block(x: MatRef<'_, f64>, targets: MatRef<'_, f64>) -> Result<(), GpError> {
    assert_eq!(x.nrows(), targets.nrows(), "one row of targets per input");
    if x.nrows() == 0 || targets.ncols() == 0 {
        return Err(GpError::TooFewSamples {
            n_samples: 0,
            needed: 1,
        });
    }
    require_finite_inputs(x)?;
    for row in 0..targets.nrows() {
        for task in 0..targets.ncols() {
            let value = targets[(row, task)];
            if !value.is_finite() {
                return Err(GpError::NonFiniteTarget { row, value });
            }
        }
    }
    Ok(())
}
