//! A model asked for a load of which it has not one sample, by the load's data sheet.

use std::sync::Arc;

use puma_dyn::Context;

use crate::error::TorqueError;
use crate::joint_model::JointModel;
use crate::load_description::LoadDescription;
use crate::rigid_body::SharedJoint;
use crate::robot_model::RobotModel;

/// The model with one more context, in which a load of known mass and first moments is carried.
///
/// For models whose K^ρ is by descriptors; the predictions of the other contexts stay, to the bit.
/// # Errors
/// [`TorqueError::OtherKind`] for a model that does not know what its contexts carry;
/// [`TorqueError::InconsistentModel`] for a name that is taken; numbers that are not finite.
pub fn carry_described(
    model: &RobotModel,
    name: &str,
    load: &LoadDescription,
) -> Result<RobotModel, TorqueError> {
    let mut parts = model.parts().clone();
    for (_, joint_model) in &mut parts.learned {
        let process = joint_model.tasks();
        let grown = process.and_then(|process| process.with_described(&load.descriptors()));
        let Some(grown) = grown else {
            let what = "it was learned without data sheets of its loads, so that one says nothing of a new load";
            return Err(TorqueError::OtherKind {
                what: what.to_owned(),
            });
        };
        *joint_model = JointModel::from(grown?);
    }
    parts.contexts.push(name.to_owned());
    parts.context_ranges.push(parts.ranges.clone());
    RobotModel::new(parts)
}

/// The model of the robot carrying what is known exactly, in one context: see
/// [`crate::rigid_body::ParameterPosterior::carrying`].
///
/// For models of a robot's parameters.
/// # Errors
/// [`TorqueError::OtherKind`] for another model; numbers that overflow.
/// # Panics
/// If a payload is of another robot.
pub fn carry_attached(
    model: &RobotModel,
    name: &str,
    carried: &Context,
) -> Result<RobotModel, TorqueError> {
    let Some(posterior) = model.rigid_body() else {
        let what =
            "it is no model of a robot's parameters, to which those of a load could be added";
        return Err(TorqueError::OtherKind {
            what: what.to_owned(),
        });
    };
    let loaded = Arc::new(posterior.carrying(name, carried)?);
    let mut parts = model.parts().clone();
    parts.contexts = vec![name.to_owned()];
    parts.context_ranges = vec![parts.ranges.clone()];
    for (joint_idx, joint_model) in &mut parts.learned {
        if let Some(joint) = SharedJoint::new(&loaded, *joint_idx) {
            *joint_model = JointModel::Shared(Box::new(joint));
        }
    }
    RobotModel::new(parts)
}
