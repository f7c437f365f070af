//! The learned model of several contexts in the form that a control loop asks, one state at a time.

use gp_core::{GpError, Predictor, PredictorScratch, TrainingRanges};

use crate::error::MtgpError;
use crate::model::multi_task_model::{MultiTaskModel, number_of};

/// Predicts all learned joints at one state in any context.
///
/// What depends on the context is worked out for each when the predictor is made, so
/// picking up another load is a change of an index.
/// ```text
/// β^γ_p = (K^ρ)_γγ(p) β_p,   mean(x, γ) = Σ_p β^γ_p c^x(p, x)
/// ```
/// Memory: the factors once, 2r + 7ℓ numbers for every joint and context beside them.
/// # Source
/// The posterior mean of sec. 4.3.1.
#[derive(Debug, Clone)]
pub struct ContextPredictor {
    predictor: Predictor,
    contexts: Vec<String>,
    context_ranges: Vec<TrainingRanges>,
}

impl ContextPredictor {
    pub(crate) fn new(model: &MultiTaskModel) -> Self {
        let processes = model.learned().iter();
        let processes = processes.map(|(idx, p)| (*idx, p.predictor(), p.noise_var()));
        let ranges = model.ranges().clone();
        Self {
            predictor: Predictor::of_processes(model.n_joints(), processes.collect(), ranges),
            contexts: model.contexts().to_vec(),
            context_ranges: model.context_ranges().to_vec(),
        }
    }

    /// Names of the contexts.
    pub fn contexts(&self) -> &[String] {
        &self.contexts
    }

    /// The number of a context, for the loop.
    ///
    /// # Errors
    /// [`MtgpError::UnknownContext`].
    pub fn number_of(&self, context: &str) -> Result<usize, MtgpError> {
        number_of(context, &self.contexts)
    }

    /// Number of learned joints, the length of a prediction.
    pub fn n_learned(&self) -> usize {
        self.predictor.n_learned()
    }

    /// Index of every learned joint among all joints of the robot.
    pub fn joint_indices(&self) -> &[usize] {
        self.predictor.joint_indices()
    }

    /// Variance of the noise of every learned joint, N²·m²: add it for that of an observation.
    pub fn noise_vars(&self) -> &[f64] {
        self.predictor.noise_vars()
    }

    /// The range of every covariate in the training data of all contexts.
    pub fn ranges(&self) -> &TrainingRanges {
        self.predictor.ranges()
    }

    /// The range of every covariate in the training data of each context.
    pub fn context_ranges(&self) -> &[TrainingRanges] {
        &self.context_ranges
    }

    /// Scratch for [`ContextPredictor::predict_into`], for any context; the only allocation a loop needs.
    pub fn scratch(&self) -> PredictorScratch {
        self.predictor.scratch()
    }

    /// Means and latent variances of all learned joints at one state in a context, by its number.
    ///
    /// Allocates nothing, also where the context is another than before.
    /// A state that is not finite is an error and leaves NaN in `mean` and `var`.
    /// # Shapes
    /// `x` (3ℓ,) in the order (q, q̇, q̈); `mean` (n_learned,), N·m; `var` (n_learned,), N²·m².
    /// # Errors
    /// [`GpError::NonFiniteInput`] with the column of the first such covariate.
    /// # Panics
    /// On other lengths, with the scratch of another predictor, or if there is no such context.
    pub fn predict_into(
        &self,
        context: usize,
        scratch: &mut PredictorScratch,
        x: &[f64],
        mean: &mut [f64],
        var: &mut [f64],
    ) -> Result<(), GpError> {
        (self.predictor).predict_context_into(context, scratch, x, mean, var)
    }
}
