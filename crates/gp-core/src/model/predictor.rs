//! The trained model in the form that a control loop asks, one state at a time.
//!
//! Everything that does not depend on the state is worked out when the predictor
//! is made: the linear and sgn parts of a process's mean become one weight each,
//! and the triangular factors of its variance are laid out for forward substitution.
//! A call then allocates nothing, takes no lock and reads no clock.
//!
//! Variances come from triangular solves, not from a product with a precomputed
//! inverse: φ = L⁻¹k by substitution is exact for a factor within r ε |L| of L,
//! while kᵀ(LLᵀ)⁻¹k with the product formed loses another factor cond(L)² to
//! cancellation against c(x, x), and pivots are dropped only when L is nearly singular.

use kernels::sgn;

use crate::error::GpError;
use crate::model::joint_model::JointModel;
use crate::model::linear_predictor::LinearPredictor;
use crate::model::process_predictor::ProcessPredictor;
use crate::model::torque_model::TorqueModel;
use crate::model::training_ranges::TrainingRanges;

/// Predicts all learned joints at one state.
///
/// One predictor serves any number of threads, each with a scratch of its own.
/// The results do not depend on the width of the machine's vectors.
/// A process costs O(r² + rℓ) for r basis points: the pivots of a low-rank factor,
/// or all training points of a dense one.
#[derive(Debug, Clone)]
pub struct Predictor {
    n_joints: usize,
    joints: Vec<JointPredictor>,
    joint_indices: Vec<usize>,
    noise_vars: Vec<f64>,
    ranges: TrainingRanges,
    n_views: usize,
}

/// Scratch of a [`Predictor`], one per thread.
#[derive(Debug, Clone)]
pub struct PredictorScratch {
    signs: Vec<f64>,        // (ℓ,)
    correlations: Vec<f64>, // (largest r,)
    k: Vec<f64>,            // (largest r or p,)
}

#[derive(Debug, Clone)]
enum JointPredictor {
    Linear(LinearPredictor),
    Process(Box<ProcessPredictor>),
}

impl JointPredictor {
    fn new(model: &JointModel) -> Self {
        match model {
            JointModel::Linear(linear) => Self::Linear(LinearPredictor::new(linear)),
            JointModel::Process(process) => {
                Self::Process(Box::new(ProcessPredictor::new(&process.posterior)))
            }
        }
    }

    /// Scratch entries needed.
    fn order(&self) -> usize {
        match self {
            Self::Linear(linear) => linear.n_features(),
            Self::Process(process) => process.n_points(),
        }
    }

    fn predict(&self, view: usize, scratch: &mut PredictorScratch, x: &[f64]) -> (f64, f64) {
        let order = self.order();
        let k = &mut scratch.k[..order];
        match self {
            Self::Linear(linear) => linear.predict(x, &scratch.signs, k),
            Self::Process(process) => {
                let correlations = &mut scratch.correlations[..order];
                process.predict(view, x, &scratch.signs, correlations, k)
            }
        }
    }
}

impl Predictor {
    pub(crate) fn new(model: &TorqueModel) -> Self {
        let learned = model.learned();
        Self {
            n_joints: model.n_joints(),
            joints: learned
                .iter()
                .map(|(_, m)| JointPredictor::new(m))
                .collect(),
            joint_indices: learned.iter().map(|(idx, _)| *idx).collect(),
            noise_vars: learned.iter().map(|(_, m)| m.noise_var()).collect(),
            ranges: model.ranges().clone(),
            n_views: 1,
        }
    }

    /// Of processes with the same contexts, each with its joint's index and the variance of its noise.
    ///
    /// # Panics
    /// If there is no process, or they differ in their numbers of contexts.
    pub fn of_processes(
        n_joints: usize,
        processes: Vec<(usize, ProcessPredictor, f64)>,
        ranges: TrainingRanges,
    ) -> Self {
        let n_views = processes[0].1.n_views();
        let mut predictor = Self {
            n_joints,
            joints: Vec::new(),
            joint_indices: Vec::new(),
            noise_vars: Vec::new(),
            ranges,
            n_views,
        };
        for (joint_idx, process, noise_var) in processes {
            assert_eq!(process.n_views(), n_views, "the joints' contexts differ");
            let process = JointPredictor::Process(Box::new(process));
            predictor.joints.push(process);
            predictor.joint_indices.push(joint_idx);
            predictor.noise_vars.push(noise_var);
        }
        predictor
    }

    /// Number of contexts; one unless it is [`Predictor::of_processes`] of several.
    pub fn n_contexts(&self) -> usize {
        self.n_views
    }

    /// Number of learned joints, the length of a prediction.
    pub fn n_learned(&self) -> usize {
        self.joints.len()
    }

    /// Index of every learned joint among all joints of the robot.
    pub fn joint_indices(&self) -> &[usize] {
        &self.joint_indices
    }

    /// Variance of the noise of every learned joint, N²·m²: add it for that of an observation.
    pub fn noise_vars(&self) -> &[f64] {
        &self.noise_vars
    }

    /// The range of every covariate in the training data.
    pub fn ranges(&self) -> &TrainingRanges {
        &self.ranges
    }

    /// Scratch for [`Predictor::predict_into`]; the only allocation a loop needs.
    pub fn scratch(&self) -> PredictorScratch {
        let largest = self.joints.iter().map(JointPredictor::order).max();
        let largest = largest.unwrap_or_default();
        PredictorScratch {
            signs: vec![0.0; self.n_joints],
            correlations: vec![0.0; largest],
            k: vec![0.0; largest],
        }
    }

    /// Means and latent variances of all learned joints at one state.
    ///
    /// Allocates nothing.
    /// A state that is not finite is an error and leaves NaN in `mean` and `var`,
    /// so that no older torque stays in them.
    /// A finite state so large that c(x, x) overflows gives NaN or infinities, no error.
    /// # Shapes
    /// `x` (3ℓ,) in the order (q, q̇, q̈), rad, rad/s, rad/s²; `mean` (n_learned,), N·m;
    /// `var` (n_learned,), N²·m².
    /// # Errors
    /// [`GpError::NonFiniteInput`] with the column of the first such covariate.
    /// # Panics
    /// On other lengths, or with the scratch of another predictor.
    pub fn predict_into(
        &self,
        scratch: &mut PredictorScratch,
        x: &[f64],
        mean: &mut [f64],
        var: &mut [f64],
    ) -> Result<(), GpError> {
        self.predict_context_into(0, scratch, x, mean, var)
    }

    /// As [`Predictor::predict_into`], in a context: switching it is a change of an index.
    ///
    /// # Errors
    /// As for [`Predictor::predict_into`].
    /// # Panics
    /// As for [`Predictor::predict_into`], or if there is no such context.
    pub fn predict_context_into(
        &self,
        context: usize,
        scratch: &mut PredictorScratch,
        x: &[f64],
        mean: &mut [f64],
        var: &mut [f64],
    ) -> Result<(), GpError> {
        let view = context;
        assert!(view < self.n_views, "context {view} of {}", self.n_views);
        assert_eq!(x.len(), 3 * self.n_joints, "x holds (q, qd, qdd)");
        assert_eq!(mean.len(), self.n_learned());
        assert_eq!(var.len(), self.n_learned());
        assert_eq!(scratch.signs.len(), self.n_joints, "another scratch");
        if let Some(column) = x.iter().position(|value| !value.is_finite()) {
            mean.fill(f64::NAN);
            var.fill(f64::NAN);
            let value = x[column];
            return Err(GpError::NonFiniteInput {
                row: 0,
                column,
                value,
            });
        }

        let velocities = &x[self.n_joints..2 * self.n_joints];
        for (sign, velocity) in scratch.signs.iter_mut().zip(velocities) {
            *sign = sgn(*velocity);
        }
        for ((joint, mean), var) in self.joints.iter().zip(mean).zip(var) {
            (*mean, *var) = joint.predict(view, scratch, x);
        }
        Ok(())
    }
}
