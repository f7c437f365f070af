//! What is learned for a robot: a model of some or all of its joints, for one load or for many.

use std::sync::{Arc, OnceLock};

use faer::MatRef;
use gp_core::Prediction;
use mtgp::MtgpError;
use puma_dyn::Model;

use crate::error::{TorqueError, consistent};
use crate::file::{ModelFileError, ModelFileKind, read_model, write_model};
use crate::joint_model::JointModel;
use crate::learn::RankSelection;
use crate::predictor::Predictor;
use crate::process::TaskProcess;
use crate::provenance::Provenance;
use crate::ranges::TrainingRanges;
use crate::robot_source::RobotSource;
use crate::rows::require_states;

/// Samples up to which a step of a tracker is fast enough without pivots.
const FEW: usize = 512;

/// Nats of the log marginal likelihood that a tracker does not see.
const TRACKING_CERTIFICATE: f64 = 0.1;

/// What is learned for a robot: a torque model for some or all of its joints.
///
/// Every joint's model sees the whole state x = (q, q̇, q̈) of all ℓ joints.
/// A model of several loads knows each by the name of its *context*.
/// ```
/// use faer::Mat;
/// use torque_model::learn::Linear;
/// use torque_model::{JointTorques, Provenance, RobotModel, Samples};
///
/// // One joint: columns q, qd, qdd.
/// let x = Mat::from_fn(20, 3, |i, j| ((i + 1) * (j + 1)) as f64 % 7.0 - 3.0);
/// let values = (0..20).map(|i| 2.0 * x[(i, 0)] + 0.5 * x[(i, 2)]).collect();
/// let torques = vec![JointTorques { joint_idx: 0, values }];
/// let samples = Samples::of_one_context(vec!["elbow".to_owned()], x, torques)?;
///
/// let provenance = Provenance::new("example 1.0", b"where the samples came from");
/// let model = RobotModel::learn(&samples, &Linear::smooth(), provenance)?;
/// let loaded = RobotModel::from_bytes(&model.to_bytes())?;
/// let x = samples.x.as_ref();
/// assert_eq!(loaded.predict(0, x)?, model.predict(0, x)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct RobotModel {
    parts: ModelParts,
    /// What `parts.robot` describes.
    robot: Option<Arc<Model>>,
    predictor: OnceLock<Predictor>,
}

/// What a model consists of.
#[derive(Debug, Clone)]
pub struct ModelParts {
    /// Names of all joints of the robot, in the order of the covariates.
    pub joint_names: Vec<String>,
    /// Names of the contexts, in the order of their numbers; none for a model of one.
    pub contexts: Vec<String>,
    /// The joints' models, each with the index of its joint, in ascending order.
    pub learned: Vec<(usize, JointModel)>,
    /// The range of every covariate in the training data of all contexts.
    pub ranges: TrainingRanges,
    /// The same of each context.
    pub context_ranges: Vec<TrainingRanges>,
    /// How the rank of K^ρ was chosen, if it was.
    pub selection: Option<RankSelection>,
    /// The robot whose parameters are known, if any.
    pub robot: Option<RobotSource>,
    /// Where the model comes from.
    pub provenance: Provenance,
}

/// Means and variances of one joint's torque at a set of states.
#[derive(Debug, Clone, PartialEq)]
pub struct JointPrediction {
    /// Index of the joint among all joints of the robot.
    pub joint_idx: usize,
    /// Posterior means, N·m.
    pub mean: Vec<f64>,
    /// Variances of the latent (noise-free) torque, N²·m².
    pub var: Vec<f64>,
    /// Variance of the noise: add it to `var` for that of an observation, N²·m².
    pub noise_var: f64,
}

impl RobotModel {
    /// The model of these parts.
    ///
    /// # Errors
    /// [`TorqueError::InconsistentModel`] if there is no joint or model, two joints
    /// or contexts of one name, indices that do not ascend or point past the last joint,
    /// models of different kinds, or models or ranges for other joints or contexts;
    /// [`TorqueError::Robot`] for a description that is none.
    pub fn new(parts: ModelParts) -> Result<Self, TorqueError> {
        consistent(inconsistency(&parts))?;
        let robot = match &parts.robot {
            None => None,
            Some(source) => {
                let robot = source.model("the model's robot")?;
                consistent(other_robot(&parts, &robot))?;
                Some(Arc::new(robot))
            }
        };
        Ok(Self {
            parts,
            robot,
            predictor: OnceLock::new(),
        })
    }

    /// All that it consists of.
    pub fn parts(&self) -> &ModelParts {
        &self.parts
    }

    /// All that it consists of, to be put together anew.
    pub fn into_parts(self) -> ModelParts {
        self.parts
    }

    /// Which kind of file it makes.
    pub fn kind(&self) -> ModelFileKind {
        kind_of(&self.parts)
    }

    /// Names of all joints of the robot, in the order of the covariates.
    pub fn joint_names(&self) -> &[String] {
        &self.parts.joint_names
    }

    /// Number of joints ℓ of the robot.
    pub fn n_joints(&self) -> usize {
        self.parts.joint_names.len()
    }

    /// Names of the contexts; none for a model of one.
    pub fn contexts(&self) -> &[String] {
        &self.parts.contexts
    }

    /// The number of a context, which predictions ask for.
    ///
    /// # Errors
    /// [`MtgpError::UnknownContext`] with those that the model has.
    pub fn number_of(&self, context: &str) -> Result<usize, MtgpError> {
        let contexts = &self.parts.contexts;
        let found = contexts.iter().position(|name| name == context);
        found.ok_or_else(|| MtgpError::UnknownContext {
            name: context.to_owned(),
            known: contexts.clone(),
        })
    }

    /// The models, each with the index of its joint, in ascending order.
    pub fn learned(&self) -> &[(usize, JointModel)] {
        &self.parts.learned
    }

    /// The processes of several contexts, each with the index of its joint; none for a model of one.
    pub fn tasks(&self) -> impl Iterator<Item = (usize, &TaskProcess)> {
        let learned = self.parts.learned.iter();
        learned.filter_map(|(idx, model)| Some((*idx, model.tasks()?)))
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

    /// The robot whose parameters are known, if any.
    pub(crate) fn robot(&self) -> Option<&Arc<Model>> {
        self.robot.as_ref()
    }

    /// Means and latent variances of every learned joint at states in a context, by its number.
    ///
    /// The numbers of [`RobotModel::predictor`], state by state.
    /// # Shapes
    /// `x` (n, 3ℓ).
    /// # Errors
    /// States that are not finite or of another robot, a context that there is not.
    pub fn predict(
        &self,
        context: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<JointPrediction>, TorqueError> {
        self.predict_rows(&vec![context; x.nrows()], x)
    }

    /// As [`RobotModel::predict`], each row in a context of its own.
    ///
    /// # Errors
    /// As there.
    /// # Panics
    /// If there is not one number per row.
    pub fn predict_rows(
        &self,
        contexts: &[usize],
        x: MatRef<'_, f64>,
    ) -> Result<Vec<JointPrediction>, TorqueError> {
        assert_eq!(contexts.len(), x.nrows(), "one context per row");
        require_states(x, self.n_joints())?;
        self.in_the_loop().predict_rows(contexts, x)
    }

    /// Means and latent variances of one learned joint, by its place among them, in a context.
    ///
    /// For many states at a time, by products of matrices; they differ from those of the
    /// loop by rounding.
    /// # Errors
    /// As for [`RobotModel::predict`].
    /// # Panics
    /// If there is no such joint.
    pub fn predict_joint(
        &self,
        place: usize,
        context: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Prediction, TorqueError> {
        self.parts.learned[place].1.predict(context, x)
    }

    /// The model in the form that a control loop asks, one state at a time.
    pub fn predictor(&self) -> Predictor {
        self.in_the_loop().clone()
    }

    fn in_the_loop(&self) -> &Predictor {
        self.predictor.get_or_init(|| Predictor::new(self))
    }

    /// The model for a loop of 1 kHz: what is dense on many samples goes on a few pivots.
    ///
    /// A joint of several contexts with more than 512 samples is conditioned again by
    /// [`gp_core::Posterior::on_pivots`], with an error of at most 0.1 nats in its log marginal
    /// likelihood; the others stay, to the bit.
    /// # Errors
    /// As for [`gp_core::Posterior::new`].
    pub fn for_tracking(&self) -> Result<Self, TorqueError> {
        let mut parts = self.parts.clone();
        for (_, model) in &mut parts.learned {
            if let JointModel::Tasks(process) = model
                && process.posterior.rank() > FEW
            {
                process.posterior = process.posterior.on_pivots(TRACKING_CERTIFICATE)?;
            }
        }
        Self::new(parts)
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Vec<u8> {
        write_model(&self.parts)
    }

    /// The model in the bytes of a model file, of whatever kind.
    ///
    /// It predicts bit for bit what the model predicts whose bytes they are.
    /// # Errors
    /// [`ModelFileError`]: anything but a whole, unaltered file of a version known here.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Self::new(read_model(bytes)?).map_err(ModelFileError::of)
    }
}

/// A joint's model that knows the parameters of another robot.
fn other_robot(parts: &ModelParts, robot: &Model) -> Option<String> {
    let is_other = |model: &JointModel| match model {
        JointModel::RigidBody(process) => *process.rows.robot != *robot,
        JointModel::RigidBodyAndProcess(process) => *process.rows.robot != *robot,
        _ => false,
    };
    let (idx, _) = (parts.learned.iter()).find(|(_, model)| is_other(model))?;
    Some(format!(
        "joint {idx}'s model is of another robot than the one described"
    ))
}

/// The kind of file for a model's parts, by its first joint.
pub(crate) fn kind_of(parts: &ModelParts) -> ModelFileKind {
    parts
        .learned
        .first()
        .map_or(ModelFileKind::OneContext, |m| kind_of_joint(&m.1))
}

fn kind_of_joint(model: &JointModel) -> ModelFileKind {
    match model {
        JointModel::Linear(_) | JointModel::Process(_) => ModelFileKind::OneContext,
        JointModel::Tasks(_) => ModelFileKind::ManyContexts,
        JointModel::RigidBody(_) | JointModel::RigidBodyAndProcess(_) => ModelFileKind::RigidBody,
    }
}

/// What does not fit together, if anything.
fn inconsistency(parts: &ModelParts) -> Option<String> {
    let (n_joints, n_contexts) = (parts.joint_names.len(), parts.contexts.len());
    let n_learned = parts.learned.len();
    let kind = kind_of(parts);
    if kind == ModelFileKind::ManyContexts && (n_joints == 0 || n_contexts == 0) {
        return Some(format!(
            "{n_joints} joints, {n_contexts} contexts, {n_learned} models"
        ));
    }
    if n_joints == 0 || n_learned == 0 {
        return Some(format!("{n_joints} joints, {n_learned} models"));
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
    let is_other = |m: &JointModel| kind_of_joint(m) != kind;
    if let Some((idx, other)) = parts.learned.iter().find(|(_, m)| is_other(m)) {
        return Some(format!(
            "joint {idx}'s model is {}, unlike the first",
            other.name()
        ));
    }
    if (kind == ModelFileKind::RigidBody) != parts.robot.is_some() {
        return Some("a robot goes with models that know its parameters".to_owned());
    }
    other_joints(parts).or_else(|| other_ranges(parts))
}

/// A joint's model that is for another robot or other contexts.
fn other_joints(parts: &ModelParts) -> Option<String> {
    let (n_joints, n_contexts) = (parts.joint_names.len(), parts.contexts.len());
    let expected = n_contexts.max(1);
    let is_other = |model: &JointModel| {
        let function = model.function();
        function.n_joints() != n_joints || function.n_contexts() != expected
    };
    let (idx, model) = parts.learned.iter().find(|(_, model)| is_other(model))?;
    let function = model.function();
    let found = function.n_joints();
    Some(if n_contexts == 0 {
        format!("joint {idx}'s model is for {found} joints, not {n_joints}")
    } else {
        format!(
            "joint {idx}'s model is for {found} joints and {} contexts, not {n_joints} and {n_contexts}",
            function.n_contexts()
        )
    })
}

/// Ranges of another robot or other contexts.
fn other_ranges(parts: &ModelParts) -> Option<String> {
    let (n_joints, n_contexts) = (parts.joint_names.len(), parts.contexts.len());
    if parts.context_ranges.len() != n_contexts {
        let found = parts.context_ranges.len();
        return Some(format!("ranges of {found} contexts, not {n_contexts}"));
    }
    let mut all_ranges = parts.context_ranges.iter().chain([&parts.ranges]);
    let other = all_ranges.find(|ranges| ranges.n_covariates() != 3 * n_joints);
    other.map(|ranges| format!("{} ranges for {n_joints} joints", ranges.n_covariates()))
}

fn repeated(names: &[String]) -> Option<&String> {
    let mut numbered = names.iter().enumerate();
    numbered
        .find(|(idx, name)| names[..*idx].contains(name))
        .map(|(_, name)| name)
}

/// Predictions of no row yet.
pub(crate) fn empty_predictions(
    joint_indices: &[usize],
    noise_vars: &[f64],
    n: usize,
) -> Vec<JointPrediction> {
    let of_joint = |(joint_idx, noise_var): (&usize, &f64)| JointPrediction {
        joint_idx: *joint_idx,
        mean: vec![0.0; n],
        var: vec![0.0; n],
        noise_var: *noise_var,
    };
    joint_indices.iter().zip(noise_vars).map(of_joint).collect()
}

/// A row of a matrix as a slice of its own.
pub(crate) fn copy_row(x: MatRef<'_, f64>, row: usize, into: &mut [f64]) {
    for (entry, value) in into.iter_mut().zip(x.row(row).iter()) {
        *entry = *value;
    }
}
