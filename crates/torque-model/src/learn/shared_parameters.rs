//! rbd: a robot's parameters for all joints and loads together, with friction that is chosen joint by joint.

use std::sync::Arc;

use crate::error::{TorqueError, consistent};
use crate::joint_model::JointModel;
use crate::learn::candidate::Candidate;
use crate::learn::learner::{Learn, Learned, LearnedJoint, Watch};
use crate::rigid_body::{FitSettings, SharedJoint, TermSet, fit};
use crate::robot_source::Robot;
use crate::samples::{JointTorques, Samples};

/// A robot's parameters about their description, one vector for all joints, ten numbers for each load.
#[derive(Debug, Clone)]
pub struct SharedParameters {
    /// The robot.
    pub robot: Robot,
    /// The friction terms of every joint; chosen joint by joint if not given.
    pub terms: Option<TermSet>,
    /// What else is decided beforehand.
    pub settings: FitSettings,
}

impl SharedParameters {
    /// Friction chosen joint by joint, nothing known to be bare.
    pub fn new(robot: Robot) -> Self {
        Self {
            robot,
            terms: None,
            settings: FitSettings::default(),
        }
    }
}

impl Learn for SharedParameters {
    fn name(&self) -> String {
        "rbd".to_owned()
    }

    fn robot(&self) -> Option<&Robot> {
        Some(&self.robot)
    }

    fn together(
        &self,
        samples: &Samples,
        watch: &dyn Watch,
    ) -> Option<Result<Learned, TorqueError>> {
        Some(self.learn(samples, watch))
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        _tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        let alone = Samples {
            torques: vec![joint.clone()],
            ..samples.clone()
        };
        let learned = self.learn(&alone, &crate::learn::Silent)?;
        Ok(learned
            .joints
            .into_iter()
            .map(|joint| joint.model.into())
            .collect())
    }
}

impl SharedParameters {
    fn learn(&self, samples: &Samples, watch: &dyn Watch) -> Result<Learned, TorqueError> {
        let (robot, n_joints) = (&self.robot.model, samples.n_joints());
        consistent((robot.n_joints() != n_joints).then(|| {
            format!(
                "samples of {n_joints} joints for a robot of {}",
                robot.n_joints()
            )
        }))?;
        let names: Vec<&str> = samples
            .torques
            .iter()
            .map(|of| samples.name_of(of))
            .collect();
        for name in &names {
            watch.begins(name);
        }
        let fitted = fit(robot, samples, self.terms, &self.settings)?;
        for name in names {
            watch.learned(name);
        }
        let posterior = Arc::new(fitted.posterior);
        let of_joint = |joint_idx| {
            let joint = SharedJoint::new(&posterior, joint_idx)?;
            Some(LearnedJoint {
                joint_idx,
                model: JointModel::Shared(Box::new(joint)),
            })
        };
        Ok(Learned {
            joints: (0..n_joints).filter_map(of_joint).collect(),
            selection: None,
            terms: fitted.choice,
        })
    }
}
