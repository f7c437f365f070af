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

use std::sync::Arc;

use faer::MatRef;
use gp_core::GpError;
use kernels::sgn;
use mtgp::MtgpError;
use puma_dyn::dynamics::full_regressor;
use puma_dyn::{Model, Workspace};
use rayon::prelude::*;

use crate::error::TorqueError;
use crate::joint_model::JointModel;
use crate::parts::{ModelParts, context_number};
use crate::prediction::{JointPrediction, copy_row, empty_predictions};
use crate::predictor::linear::LinearPredictor;
use crate::predictor::process::ProcessPredictor;
use crate::predictor::regressor::RegressorPredictor;
use crate::predictor::shared::SharedPredictor;
use crate::ranges::TrainingRanges;
use crate::rows::{n_parameters, require_context};

/// States that one thread predicts before it takes others.
const PANEL: usize = 32;

/// Predicts all learned joints at one state, in any context.
///
/// What depends on the context is worked out for each when the predictor is made, so
/// picking up another load is a change of an index.
/// ```text
/// β^γ_p = (K^ρ)_γγ(p) β_p,   mean(x, γ) = Σ_p β^γ_p c^x(p, x)
/// ```
/// One predictor serves any number of threads, each with a scratch of its own.
/// The results do not depend on the width of the machine's vectors.
/// A process costs O(r² + rℓ) for r basis points: the pivots of a low-rank factor,
/// or all training points of a dense one; a rigid body O(p²) for the p parameters of a joint.
#[derive(Debug, Clone)]
pub struct Predictor {
    n_joints: usize,
    n_covariates: usize,
    joints: Vec<JointPredictor>,
    joint_indices: Vec<usize>,
    noise_vars: Vec<f64>,
    contexts: Vec<String>,
    ranges: TrainingRanges,
    context_ranges: Vec<TrainingRanges>,
    robot: Option<Arc<Model>>,
}

/// Scratch of a [`Predictor`], one per thread.
#[derive(Debug, Clone)]
pub struct Scratch {
    signs: Vec<f64>,        // (ℓ,)
    z: Vec<f64>,            // (largest number of columns of an embedded state,)
    correlations: Vec<f64>, // (largest r,)
    k: Vec<f64>,            // (largest r or number of features,)
    y: Vec<f64>,            // a joint's columns of Y, and as many more
    regressor: Vec<f64>,    // Y, (ℓ, 14 ℓ), row after row, or empty
    workspace: Option<Workspace>,
}

#[derive(Debug, Clone)]
enum JointPredictor {
    Linear(LinearPredictor),
    Process(Box<ProcessPredictor>),
    RigidBody(Box<RegressorPredictor>),
    Shared(Box<SharedPredictor>),
}

impl JointPredictor {
    fn new(model: &JointModel) -> Self {
        let process = |process| Self::Process(Box::new(process));
        match model {
            JointModel::Linear(linear) => Self::Linear(LinearPredictor::new(linear)),
            JointModel::Process(of_states) => process(ProcessPredictor::of_states(of_states)),
            JointModel::Tasks(of_tasks) => process(ProcessPredictor::of_tasks(of_tasks)),
            JointModel::RigidBody(of_robot) => Self::RigidBody(Box::new(RegressorPredictor::new(
                &of_robot.posterior,
                &of_robot.rows,
            ))),
            JointModel::Shared(joint) => Self::Shared(Box::new(SharedPredictor::new(joint))),
            JointModel::RigidBodyAndProcess(both) => process(ProcessPredictor::of_rigid_body(both)),
        }
    }

    /// Scratch entries needed for k, and for y.
    fn orders(&self) -> (usize, usize) {
        match self {
            Self::Linear(linear) => (linear.n_features(), 0),
            Self::Process(process) => (process.n_points(), process.n_parameters()),
            Self::RigidBody(rigid_body) => (0, rigid_body.n_scratch()),
            Self::Shared(shared) => (0, shared.n_scratch()),
        }
    }

    /// Scratch entries needed for an embedded state.
    fn n_embedded(&self) -> usize {
        match self {
            Self::Process(process) => process.n_embedded(),
            Self::Linear(_) | Self::RigidBody(_) | Self::Shared(_) => 0,
        }
    }

    fn predict(
        &self,
        context: usize,
        scratch: &mut Scratch,
        x: &[f64],
        joint_idx: usize,
    ) -> (f64, f64) {
        let (order, n_parameters) = self.orders();
        let k = &mut scratch.k[..order];
        let y = &mut scratch.y[..n_parameters];
        let of_joint = match scratch.regressor.len() / scratch.signs.len() {
            0 => &[],
            length => &scratch.regressor[joint_idx * length..][..length],
        };
        match self {
            Self::Linear(linear) => linear.predict(x, &scratch.signs, k),
            Self::Process(process) => {
                let correlations = &mut scratch.correlations[..order];
                let state = (x, scratch.signs.as_slice(), of_joint);
                let z = &mut scratch.z[..process.n_embedded()];
                process.predict(context, state, z, correlations, k, y)
            }
            Self::RigidBody(rigid_body) => rigid_body.predict(of_joint, y),
            Self::Shared(shared) => shared.predict(context, x, of_joint, y),
        }
    }

    /// Variance of the noise at a state, where it depends on that.
    fn noise_var(&self, x: &[f64]) -> Option<f64> {
        match self {
            Self::Shared(shared) => Some(shared.noise_var(x)),
            Self::Linear(_) | Self::Process(_) | Self::RigidBody(_) => None,
        }
    }
}

impl Predictor {
    /// Of a model's parts, with the robot that they describe, if any.
    pub(crate) fn new(parts: &ModelParts, robot: Option<Arc<Model>>) -> Self {
        let learned = parts.learned.iter();
        Self {
            n_joints: parts.joint_names.len(),
            n_covariates: parts.n_covariates(),
            joints: (learned.clone())
                .map(|(_, m)| JointPredictor::new(m))
                .collect(),
            joint_indices: learned.clone().map(|(idx, _)| *idx).collect(),
            noise_vars: learned.map(|(_, m)| m.noise_var()).collect(),
            contexts: parts.contexts.clone(),
            ranges: parts.ranges.clone(),
            context_ranges: parts.context_ranges.clone(),
            robot,
        }
    }

    /// Names of the contexts; none for a model of one.
    pub fn contexts(&self) -> &[String] {
        &self.contexts
    }

    /// Number of contexts; one for a model of one.
    pub fn n_contexts(&self) -> usize {
        self.contexts.len().max(1)
    }

    /// The number of a context, for the loop.
    ///
    /// # Errors
    /// [`MtgpError::UnknownContext`] with those that the model has.
    pub fn number_of(&self, context: &str) -> Result<usize, MtgpError> {
        context_number(&self.contexts, context)
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
    ///
    /// Where the noise depends on the speed, [`Predictor::noise_vars_into`] has it at a state, and this is σ².
    pub fn noise_vars(&self) -> &[f64] {
        &self.noise_vars
    }

    /// The same at a state.
    ///
    /// Allocates nothing.
    /// # Shapes
    /// `x` (n_covariates,); `vars` (n_learned,), N²·m².
    pub fn noise_vars_into(&self, x: &[f64], vars: &mut [f64]) {
        let joints = self.joints.iter().zip(&self.noise_vars);
        for (var, (joint, constant)) in vars.iter_mut().zip(joints) {
            *var = joint.noise_var(x).unwrap_or(*constant);
        }
    }

    /// Entries of a state: (q, q̇, q̈), and the hysteresis states of a model with memory.
    pub fn n_covariates(&self) -> usize {
        self.n_covariates
    }

    /// The range of every covariate in the training data of all contexts.
    pub fn ranges(&self) -> &TrainingRanges {
        &self.ranges
    }

    /// The same of each context.
    pub fn context_ranges(&self) -> &[TrainingRanges] {
        &self.context_ranges
    }

    /// Scratch for [`Predictor::predict_into`], for any context; the only allocation a loop needs.
    pub fn scratch(&self) -> Scratch {
        let largest = |order: fn(&JointPredictor) -> usize| {
            self.joints.iter().map(order).max().unwrap_or_default()
        };
        let of_regressor = |robot: &Arc<Model>| robot.n_joints() * n_parameters(robot);
        let order = largest(|joint| joint.orders().0);
        Scratch {
            signs: vec![0.0; self.n_joints],
            z: vec![0.0; largest(JointPredictor::n_embedded)],
            correlations: vec![0.0; order],
            k: vec![0.0; order],
            y: vec![0.0; largest(|joint| joint.orders().1)],
            regressor: vec![0.0; self.robot.as_ref().map_or(0, of_regressor)],
            workspace: self.robot.as_ref().map(|robot| Workspace::new(robot)),
        }
    }

    /// Means and latent variances of all learned joints at one state in a context, by its number.
    ///
    /// Allocates nothing, also where the context is another than before; a model of one context has
    /// number 0.
    /// After an error `mean` and `var` are NaN, so that no older torque stays in them.
    /// # Shapes
    /// `x` (3ℓ,) in the order (q, q̇, q̈), rad, rad/s, rad/s², and for a model with memory its
    /// [`crate::RobotModel::hysteresis`] behind them; `mean` (n_learned,), N·m;
    /// `var` (n_learned,), N²·m².
    /// # Errors
    /// [`GpError::NonFiniteInput`] with the column of the first such covariate;
    /// [`TorqueError::NotFinite`] with the joint, for a state so large that its torque overflows.
    /// # Panics
    /// On other lengths, with the scratch of another predictor, or if there is no such context.
    pub fn predict_into(
        &self,
        context: usize,
        scratch: &mut Scratch,
        x: &[f64],
        mean: &mut [f64],
        var: &mut [f64],
    ) -> Result<(), TorqueError> {
        let n_contexts = self.n_contexts();
        assert!(context < n_contexts, "context {context} of {n_contexts}");
        assert_eq!(x.len(), self.n_covariates, "x holds (q, qd, qdd) and z");
        assert_eq!(mean.len(), self.n_learned());
        assert_eq!(var.len(), self.n_learned());
        assert_eq!(scratch.signs.len(), self.n_joints, "another scratch");
        let outcome = self.fill(context, scratch, x, mean, var);
        if outcome.is_err() {
            mean.fill(f64::NAN);
            var.fill(f64::NAN);
        }
        outcome
    }

    fn fill(
        &self,
        context: usize,
        scratch: &mut Scratch,
        x: &[f64],
        mean: &mut [f64],
        var: &mut [f64],
    ) -> Result<(), TorqueError> {
        if let Some(column) = x.iter().position(|value| !value.is_finite()) {
            let (row, value) = (0, x[column]);
            return Err(GpError::NonFiniteInput { row, column, value }.into());
        }
        let (q, rates) = x.split_at(self.n_joints);
        let (qd, rest) = rates.split_at(self.n_joints);
        let qdd = &rest[..self.n_joints];
        for (sign, velocity) in scratch.signs.iter_mut().zip(qd) {
            *sign = sgn(*velocity);
        }
        if let (Some(robot), Some(workspace)) = (&self.robot, &mut scratch.workspace) {
            full_regressor(robot, workspace, q, qd, qdd, &mut scratch.regressor);
        }
        let joints = self.joints.iter().zip(&self.joint_indices);
        for ((joint, joint_idx), (mean, var)) in joints.zip(mean.iter_mut().zip(var)) {
            (*mean, *var) = joint.predict(context, scratch, x, *joint_idx);
            if !(mean.is_finite() && var.is_finite()) {
                let (row, joint_idx) = (0, *joint_idx);
                return Err(TorqueError::NotFinite { row, joint_idx });
            }
        }
        Ok(())
    }

    /// Predictions at the rows of `x`, (n, n_covariates), each in a context of its own: those of the loop.
    ///
    /// On all threads at hand, and the same bits for any number of them; of several failures the first row's counts.
    pub(crate) fn predict_rows(
        &self,
        contexts: &[usize],
        x: MatRef<'_, f64>,
    ) -> Result<Vec<JointPrediction>, TorqueError> {
        let (n, n_learned) = (x.nrows(), self.n_learned());
        for context in contexts {
            require_context(*context, self.n_contexts())?;
        }
        let mut numbers = vec![0.0; 2 * n_learned * n];
        let panels = numbers.par_chunks_mut(2 * n_learned * PANEL).enumerate();
        // Collected in their order, so that of several failures the first row's counts.
        let outcomes: Vec<Result<(), TorqueError>> = panels
            .map_init(
                || (self.scratch(), vec![0.0; x.ncols()]),
                |(scratch, state), (panel, numbers)| {
                    for (idx, of_row) in numbers.chunks_exact_mut(2 * n_learned).enumerate() {
                        let row = panel * PANEL + idx;
                        copy_row(x, row, state);
                        let (mean, var) = of_row.split_at_mut(n_learned);
                        (self.fill(contexts[row], scratch, state, mean, var))
                            .map_err(|error| error.in_row(row))?;
                    }
                    Ok(())
                },
            )
            .collect();
        outcomes.into_iter().collect::<Result<(), _>>()?;
        let mut predictions = empty_predictions(&self.joint_indices, &self.noise_vars, n);
        for (row, of_row) in numbers.chunks_exact(2 * n_learned).enumerate() {
            let (mean, var) = of_row.split_at(n_learned);
            for (place, joint) in predictions.iter_mut().enumerate() {
                (joint.mean[row], joint.var[row]) = (mean[place], var[place]);
            }
        }
        self.fill_noise(x, &mut predictions);
        Ok(predictions)
    }

    /// Noise that depends on the state, row by row.
    fn fill_noise(&self, x: MatRef<'_, f64>, predictions: &mut [JointPrediction]) {
        let varies = |joint: &JointPredictor| matches!(joint, JointPredictor::Shared(_));
        if !self.joints.iter().any(varies) {
            return;
        }
        let mut state = vec![0.0; x.ncols()];
        for row in 0..x.nrows() {
            copy_row(x, row, &mut state);
            for (joint, prediction) in self.joints.iter().zip(predictions.iter_mut()) {
                if let Some(var) = joint.noise_var(&state) {
                    prediction.noise_var[row] = var;
                }
            }
        }
    }
}
