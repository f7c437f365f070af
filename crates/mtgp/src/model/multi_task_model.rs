//! The torque models of a robot's joints under several loads, with what they were learned from.

use faer::MatRef;
use gp_core::{
    GpError, JointPrediction, ModelFileError, ModelFileKind, Provenance, TrainingRanges,
    decode_model, encode_model,
};

use crate::error::{MtgpError, require_count};
use crate::model::context_predictor::ContextPredictor;
use crate::model::record::MultiTaskRecord;
use crate::model::task_process::TaskProcess;
use crate::prior::TaskRow;

/// Samples up to which a step of a tracker is fast enough without pivots.
const FEW: usize = 512;

/// Nats of the log marginal likelihood that a tracker does not see.
const TRACKING_CERTIFICATE: f64 = 0.1;

/// What is learned for a robot under several loads: a process for some or all of its joints.
///
/// A *context* of the data, known by its name, is the *task* of its number.
#[derive(Debug, Clone)]
pub struct MultiTaskModel {
    parts: ModelParts,
}

/// What a model consists of.
#[derive(Debug, Clone)]
pub struct ModelParts {
    /// Names of all joints of the robot, in the order of the covariates.
    pub joint_names: Vec<String>,
    /// Names of the contexts, in the order of the tasks.
    pub contexts: Vec<String>,
    /// The processes, each with the index of its joint, in ascending order.
    pub learned: Vec<(usize, TaskProcess)>,
    /// The range of every covariate in the training data of all contexts.
    pub ranges: TrainingRanges,
    /// The same of each context.
    pub context_ranges: Vec<TrainingRanges>,
    /// How the rank was chosen, if it was.
    pub selection: Option<RankSelection>,
    /// Where the model comes from.
    pub provenance: Provenance,
}

/// How the rank of the task matrices was chosen.
#[derive(Debug, Clone, PartialEq)]
pub struct RankSelection {
    /// Name of the criterion.
    pub criterion: String,
    /// Every rank tried with its value: the least is best.
    pub values: Vec<(usize, f64)>,
}

impl MultiTaskModel {
    /// The model of these parts.
    ///
    /// # Errors
    /// [`GpError::InconsistentModel`] if there is no joint, context or process, two joints
    /// or contexts of one name, indices that do not ascend or point past the last joint, or
    /// processes or ranges for other joints or contexts.
    pub fn new(parts: ModelParts) -> Result<Self, GpError> {
        match inconsistency(&parts) {
            Some(what) => Err(GpError::InconsistentModel { what }),
            None => Ok(Self { parts }),
        }
    }

    /// The model with one more context, whose rows of Λ are known.
    ///
    /// The posterior given the old data stays as it is, and so do the predictions of the old
    /// contexts, to the bit; that of the new one is Mλ with the covariance of [`crate::latent::LatentFunctions`].
    /// # Shapes
    /// One row per learned joint, in their order; `ranges` of the new context's data.
    /// # Errors
    /// [`MtgpError::CountMismatch`] for another number of rows; as for
    /// [`crate::TaskCovariance::with_row`]; as for [`MultiTaskModel::new`], a name that is taken among them.
    /// # Source
    /// Section 5: novel contexts.
    pub fn with_context(
        &self,
        name: &str,
        rows: &[TaskRow],
        ranges: TrainingRanges,
    ) -> Result<Self, MtgpError> {
        require_count("rows of joints", rows.len(), self.learned().len())?;
        let mut parts = self.parts.clone();
        for ((_, process), row) in parts.learned.iter_mut().zip(rows) {
            *process = process.with_row(row)?;
        }
        parts.contexts.push(name.to_owned());
        parts.ranges = parts.ranges.union(&ranges);
        parts.context_ranges.push(ranges);
        Ok(Self::new(parts)?)
    }

    /// The model conditioned on further torques of a context, with the same hyperparameters.
    ///
    /// ```text
    /// p(f | D, D*),   as if all samples had been conditioned on at once
    /// ```
    /// All contexts learn from them; no matrix of the old samples is factorised again. Ranges stay:
    /// those of a new context's data are given with the context.
    /// # Shapes
    /// `x` (k, 3ℓ); `torques` (k,) of every learned joint, in their order, N·m.
    /// # Errors
    /// [`MtgpError::UnknownContext`]; [`MtgpError::CountMismatch`] for another number of joints; as for
    /// [`gp_core::Posterior::with_samples`].
    /// # Source
    /// Section 5: inference with the grown K^ρ; eqs. (3)–(4).
    pub fn with_samples(
        &self,
        context: &str,
        x: MatRef<'_, f64>,
        torques: &[Vec<f64>],
    ) -> Result<Self, MtgpError> {
        let task = self.number_of(context)?;
        require_count("torques of joints", torques.len(), self.learned().len())?;
        let mut parts = self.parts.clone();
        for ((_, process), torques) in parts.learned.iter_mut().zip(torques) {
            *process = process.with_samples(task, x, torques)?;
        }
        Ok(Self::new(parts)?)
    }

    /// The model for a loop of 1 kHz: what is dense on many samples goes on a few pivots.
    ///
    /// A joint with more than 512 samples is conditioned again by [`gp_core::Posterior::on_pivots`], with an
    /// error of at most 0.1 nats in its log marginal likelihood; the others stay, to the bit.
    /// # Errors
    /// As for [`gp_core::Posterior::new`].
    pub fn for_tracking(&self) -> Result<Self, GpError> {
        let mut parts = self.parts.clone();
        for (_, process) in &mut parts.learned {
            if process.posterior.rank() > FEW {
                process.posterior = process.posterior.on_pivots(TRACKING_CERTIFICATE)?;
            }
        }
        Ok(Self { parts })
    }

    /// All that it consists of.
    pub fn parts(&self) -> &ModelParts {
        &self.parts
    }

    /// Names of all joints of the robot, in the order of the covariates.
    pub fn joint_names(&self) -> &[String] {
        &self.parts.joint_names
    }

    /// Number of joints ℓ of the robot.
    pub fn n_joints(&self) -> usize {
        self.parts.joint_names.len()
    }

    /// Names of the contexts.
    pub fn contexts(&self) -> &[String] {
        &self.parts.contexts
    }

    /// The number of a context: its task.
    ///
    /// # Errors
    /// [`MtgpError::UnknownContext`] with those that the model has.
    pub fn number_of(&self, context: &str) -> Result<usize, MtgpError> {
        number_of(context, &self.parts.contexts)
    }

    /// The processes, each with the index of its joint, in ascending order.
    pub fn learned(&self) -> &[(usize, TaskProcess)] {
        &self.parts.learned
    }

    /// The range of every covariate in the training data of all contexts.
    pub fn ranges(&self) -> &TrainingRanges {
        &self.parts.ranges
    }

    /// The same of each context.
    pub fn context_ranges(&self) -> &[TrainingRanges] {
        &self.parts.context_ranges
    }

    /// Where the model comes from.
    pub fn provenance(&self) -> &Provenance {
        &self.parts.provenance
    }

    /// Means and latent variances of every learned joint in a context at the rows of `x`, (n, 3ℓ).
    ///
    /// # Errors
    /// [`MtgpError::UnknownContext`]; [`MtgpError::Gp`] for inputs that are not finite or
    /// have another number of columns.
    pub fn predict(
        &self,
        context: &str,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<JointPrediction>, MtgpError> {
        let task = self.number_of(context)?;
        let of_joint = |(joint_idx, process): &(usize, TaskProcess)| {
            let prediction = process.predict(task, x)?;
            let noise_var = process.noise_var();
            Ok(JointPrediction::new(*joint_idx, prediction, noise_var))
        };
        self.learned().iter().map(of_joint).collect()
    }

    /// The model in the form that a control loop asks, one state at a time.
    pub fn predictor(&self) -> ContextPredictor {
        ContextPredictor::new(self)
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Vec<u8> {
        encode_model(ModelFileKind::ManyContexts, &MultiTaskRecord::of(self))
    }

    /// The model in the bytes of a model file.
    ///
    /// It predicts bit for bit what the model predicts whose bytes they are.
    /// # Errors
    /// [`ModelFileError`]: anything but a whole, unaltered file of this kind of model and a
    /// version known here.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        decode_model::<MultiTaskRecord>(ModelFileKind::ManyContexts, bytes)?.into_model()
    }
}

pub(crate) fn number_of(context: &str, contexts: &[String]) -> Result<usize, MtgpError> {
    let found = contexts.iter().position(|name| name == context);
    found.ok_or_else(|| MtgpError::UnknownContext {
        name: context.to_owned(),
        known: contexts.to_vec(),
    })
}

/// What does not fit together, if anything.
fn inconsistency(parts: &ModelParts) -> Option<String> {
    let (n_joints, n_contexts) = (parts.joint_names.len(), parts.contexts.len());
    let n_learned = parts.learned.len();
    if n_joints == 0 || n_contexts == 0 || n_learned == 0 {
        return Some(format!(
            "{n_joints} joints, {n_contexts} contexts, {n_learned} models"
        ));
    }
    if let Some(name) = repeated(&parts.joint_names) {
        return Some(format!("two joints are named {name}"));
    }
    if let Some(name) = repeated(&parts.contexts) {
        return Some(format!("two contexts are named {name}"));
    }
    if parts.learned.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
        return Some("joint indices do not ascend".to_owned());
    }
    if let Some((idx, _)) = parts.learned.iter().find(|(idx, _)| *idx >= n_joints) {
        return Some(format!("a model for joint {idx} of {n_joints}"));
    }
    let is_other = |process: &TaskProcess| {
        process.n_joints() != n_joints || process.covariance().n_tasks() != n_contexts
    };
    if let Some((idx, process)) = parts.learned.iter().find(|(_, p)| is_other(p)) {
        return Some(format!(
            "joint {idx}'s model is for {} joints and {} contexts, not {n_joints} and {n_contexts}",
            process.n_joints(),
            process.covariance().n_tasks()
        ));
    }
    if parts.context_ranges.len() != n_contexts {
        let found = parts.context_ranges.len();
        return Some(format!("ranges of {found} contexts, not {n_contexts}"));
    }
    let mut all_ranges = parts.context_ranges.iter().chain([&parts.ranges]);
    let other = all_ranges.find(|ranges| ranges.n_covariates() != 3 * n_joints);
    other.map(|ranges| format!("{} ranges for {n_joints} joints", ranges.n_covariates()))
}

fn repeated(names: &[String]) -> Option<&String> {
    let is_repeated = |(idx, name): &(usize, &String)| names[..*idx].contains(name);
    names
        .iter()
        .enumerate()
        .find(is_repeated)
        .map(|(_, name)| name)
}
