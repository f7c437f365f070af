//! What a model of a robot consists of, and whether it fits together.

use std::sync::Arc;

use kernels::{ContinuousJoints, TorqueCovariance};
use mtgp::MtgpError;
use puma_dyn::Model;
use serde::{Deserialize, Serialize};

use crate::file::ModelFileKind;
use crate::joint_model::JointModel;
use crate::provenance::Provenance;
use crate::ranges::TrainingRanges;
use crate::rigid_body::ParameterPosterior;
use crate::robot_source::RobotSource;

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

impl ModelParts {
    /// The posterior that the joints share, if they share one.
    pub fn posterior(&self) -> Option<&Arc<ParameterPosterior>> {
        match self.learned.first() {
            Some((_, JointModel::Shared(joint))) => Some(joint.posterior()),
            _ => None,
        }
    }

    /// The joints of whose positions the processes see the place on the circle; none without a process.
    pub fn continuous(&self) -> ContinuousJoints {
        let mut models = self.learned.iter().map(|(_, model)| model);
        let covariance = models.find_map(JointModel::input_covariance);
        covariance.map_or_else(ContinuousJoints::none, |of| of.continuous().clone())
    }

    /// Entries of a state: (q, q̇, q̈), and the hysteresis states of a model with memory.
    pub fn n_covariates(&self) -> usize {
        let of_states = 3 * self.joint_names.len();
        self.posterior()
            .map_or(of_states, |of| of.unknowns().n_covariates())
    }
}

/// How the rank of the task matrices was chosen; its fields stand in model files in this order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RankSelection {
    /// Name of the criterion.
    pub criterion: String,
    /// Every rank tried with its value: the least is best.
    pub values: Vec<(usize, f64)>,
}

/// The number of a context by its name.
pub(crate) fn context_number(contexts: &[String], name: &str) -> Result<usize, MtgpError> {
    let found = contexts.iter().position(|known| known == name);
    found.ok_or_else(|| MtgpError::UnknownContext {
        name: name.to_owned(),
        known: contexts.to_vec(),
    })
}

/// A joint's model that knows the parameters of another robot.
pub(crate) fn other_robot(parts: &ModelParts, robot: &Model) -> Option<String> {
    let is_other = |model: &JointModel| match model {
        JointModel::RigidBody(process) => *process.rows.robot != *robot,
        JointModel::Shared(joint) => *joint.posterior().parts().robot != *robot,
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
        JointModel::Shared(_) => ModelFileKind::SharedParameters,
    }
}

/// What does not fit together, if anything.
pub(crate) fn inconsistency(parts: &ModelParts) -> Option<String> {
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
    let knows_robot = matches!(
        kind,
        ModelFileKind::RigidBody | ModelFileKind::SharedParameters
    );
    if knows_robot != parts.robot.is_some() {
        return Some("a robot goes with models that know its parameters".to_owned());
    }
    if let Some(what) = other_posterior(parts) {
        return Some(what);
    }
    other_joints(parts)
        .or_else(|| other_circles(parts))
        .or_else(|| other_ranges(parts))
}

/// A process that sees other joints' places on the circle than the first.
fn other_circles(parts: &ModelParts) -> Option<String> {
    let first = parts.continuous();
    let is_other = |of: &TorqueCovariance| *of.continuous() != first;
    let mut learned = parts.learned.iter();
    let (idx, _) = learned.find(|(_, model)| model.input_covariance().is_some_and(is_other))?;
    Some(format!(
        "joint {idx}'s process has other continuous joints than the first"
    ))
}

/// Joints that do not share one posterior, or one of other contexts.
fn other_posterior(parts: &ModelParts) -> Option<String> {
    let first = parts.posterior()?;
    let is_other = |(idx, model): &(usize, JointModel)| match model {
        JointModel::Shared(joint) => {
            !Arc::ptr_eq(joint.posterior(), first) || joint.joint_idx() != *idx
        }
        _ => true,
    };
    if let Some((idx, _)) = parts.learned.iter().find(|of| is_other(of)) {
        return Some(format!(
            "joint {idx}'s parameters are not those of the others"
        ));
    }
    (first.parts().contexts != parts.contexts)
        .then(|| "parameters of other contexts than the model's".to_owned())
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
