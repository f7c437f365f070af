//! What a way to learn consists of, and how the joints of a robot are learned by one.

use rayon::prelude::*;

use crate::error::TorqueError;
use crate::joint_model::JointModel;
use crate::learn::candidate::Candidate;
use crate::parts::{ModelParts, RankSelection};
use crate::provenance::Provenance;
use crate::rigid_body::TermChoice;
use crate::robot_model::RobotModel;
use crate::robot_source::Robot;
use crate::samples::{JointTorques, Samples};

/// A way to learn joint torques: one row of table 3, one line of figure 10, one `--model`.
pub trait Learn: Sync {
    /// Its name in tables.
    fn name(&self) -> String;

    /// Whether it learns all contexts of the samples together.
    fn is_of_many_contexts(&self) -> bool {
        false
    }

    /// The robot whose parameters it learns, if any.
    fn robot(&self) -> Option<&Robot> {
        None
    }

    /// Learns all joints in one, for learners whose joints share what they learn; `None` of the others.
    ///
    /// Of any number of contexts.
    fn together(
        &self,
        _samples: &Samples,
        _watch: &dyn Watch,
    ) -> Option<Result<Learned, TorqueError>> {
        None
    }

    /// Learns one joint, at each setting that is compared; at one where nothing is.
    ///
    /// `tell` hears what a longer stage begins with.
    /// # Errors
    /// A joint that cannot be learned from these samples.
    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError>;

    /// The setting to keep, the same for all joints, and how it was chosen.
    ///
    /// # Errors
    /// Candidates that cannot be compared.
    fn choose(
        &self,
        _samples: &Samples,
        _of_joints: &[(&JointTorques, Vec<Candidate>)],
    ) -> Result<(usize, Option<RankSelection>), TorqueError> {
        Ok((0, None))
    }

    /// The model of a candidate.
    ///
    /// # Errors
    /// One that cannot be conditioned on the samples.
    fn finish(
        &self,
        _samples: &Samples,
        _joint: &JointTorques,
        candidate: Candidate,
    ) -> Result<JointModel, TorqueError> {
        match candidate {
            Candidate::Model(model) => Ok(*model),
            Candidate::Tasks(_) => Err(TorqueError::OtherKind {
                what: "a candidate of several contexts is no model of one".to_owned(),
            }),
        }
    }
}

/// What learning says of itself while it goes on, from any thread.
pub trait Watch: Sync {
    /// A joint is begun.
    fn begins(&self, _joint: &str) {}
    /// A longer stage of a joint begins.
    fn stage(&self, _joint: &str, _n_samples: usize, _stage: &str) {}
    /// A joint is learned, at all settings.
    fn learned(&self, _joint: &str) {}
}

/// Says nothing.
#[derive(Debug, Clone, Copy)]
pub struct Silent;

impl Watch for Silent {}

/// The joints of a robot, learned.
#[derive(Debug, Clone)]
pub struct Learned {
    /// In the order of the samples' torques.
    pub joints: Vec<LearnedJoint>,
    /// How the rank was chosen, if it was.
    pub selection: Option<RankSelection>,
    /// How the friction terms were chosen, if they were.
    pub terms: Option<TermChoice>,
}

/// One joint, learned.
#[derive(Debug, Clone)]
pub struct LearnedJoint {
    /// Index of the joint among all joints of the robot.
    pub joint_idx: usize,
    /// Its model.
    pub model: JointModel,
}

/// Learns all joints that the samples have torques of, side by side on the threads at hand.
///
/// Each joint is learned in sequence, and the result is the same to the bit for any number of
/// threads; of several failures the first joint's counts.
/// # Errors
/// [`TorqueError::Joint`] for one that cannot be learned; [`TorqueError::Rank`];
/// [`TorqueError::OtherKind`] for samples of several contexts where one is needed, or of one where several are;
/// samples that do not fit together.
pub fn learn_joints(
    samples: &Samples,
    learner: &dyn Learn,
    watch: &dyn Watch,
) -> Result<Learned, TorqueError> {
    samples.check()?;
    if let Some(learned) = learner.together(samples, watch) {
        return learned;
    }
    require_contexts(samples, learner)?;
    let of_joint = |joint: &JointTorques, cause: TorqueError| TorqueError::Joint {
        joint: samples.name_of(joint).to_owned(),
        cause: Box::new(cause),
    };
    let learn = |joint| {
        let name = samples.name_of(joint);
        watch.begins(name);
        let mut tell = |stage: &str| watch.stage(name, joint.values.len(), stage);
        let candidates = learner.candidates(samples, joint, &mut tell);
        let candidates = candidates.map_err(|cause| of_joint(joint, cause))?;
        watch.learned(name);
        Ok((joint, candidates))
    };
    let all: Vec<Result<_, TorqueError>> = samples.torques.par_iter().map(learn).collect();
    let all: Vec<(&JointTorques, Vec<Candidate>)> = all.into_iter().collect::<Result<_, _>>()?;
    let (chosen, selection) = learner.choose(samples, &all)?;
    let keep = |(joint, mut candidates): (&JointTorques, Vec<Candidate>)| {
        let candidate = candidates.swap_remove(chosen);
        let model = learner.finish(samples, joint, candidate);
        Ok(LearnedJoint {
            joint_idx: joint.joint_idx,
            model: model.map_err(|cause| of_joint(joint, cause))?,
        })
    };
    Ok(Learned {
        joints: all
            .into_iter()
            .map(keep)
            .collect::<Result<_, TorqueError>>()?,
        selection,
        terms: None,
    })
}

fn require_contexts(samples: &Samples, learner: &dyn Learn) -> Result<(), TorqueError> {
    let (n, name) = (samples.contexts.len(), learner.name());
    let what = match (learner.is_of_many_contexts(), n) {
        (false, 2..) => format!("{name} learns one context, and the samples have {n}"),
        (true, 0 | 1) => format!("{name} learns several contexts, and the samples have one"),
        _ => return Ok(()),
    };
    Err(TorqueError::OtherKind { what })
}

impl RobotModel {
    /// Learns all joints that the samples have torques of: [`learn_joints`], and all that a model is made of.
    ///
    /// # Errors
    /// As for [`learn_joints`] and [`RobotModel::new`].
    pub fn learn(
        samples: &Samples,
        learner: &dyn Learn,
        provenance: Provenance,
    ) -> Result<Self, TorqueError> {
        let learned = learn_joints(samples, learner, &Silent)?;
        Self::of_learned(samples, learner, learned, provenance)
    }

    /// The model of joints that were learned from these samples.
    ///
    /// # Errors
    /// As for [`RobotModel::new`].
    pub fn of_learned(
        samples: &Samples,
        learner: &dyn Learn,
        learned: Learned,
        provenance: Provenance,
    ) -> Result<Self, TorqueError> {
        let is_shared = learned
            .joints
            .iter()
            .any(|of| of.model.posterior().is_some());
        let (contexts, context_ranges) = if learner.is_of_many_contexts() || is_shared {
            (samples.contexts.clone(), samples.context_ranges()?)
        } else {
            (Vec::new(), Vec::new())
        };
        let robot = learner.robot().map(|robot| robot.source.clone());
        let joints = learned.joints.into_iter();
        Self::new(ModelParts {
            joint_names: samples.joint_names.clone(),
            contexts,
            learned: joints.map(|joint| (joint.joint_idx, joint.model)).collect(),
            ranges: samples.ranges()?,
            context_ranges,
            selection: learned.selection,
            provenance: Provenance {
                robot_sha256: robot.as_ref().map(crate::RobotSource::sha256),
                ..provenance
            },
            robot,
        })
    }
}
