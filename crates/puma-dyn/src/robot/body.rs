//! What a model is made of: moving bodies, their joints, and the named frames on them.

use nalgebra::Matrix3;

use crate::robot::description::{JointKind, Limits};
use crate::spatial::inertia::BodyInertia;
use crate::spatial::pose::Pose;

/// How a body moves against its parent; its axis is z of its own frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    Revolute,
    Prismatic,
}

/// One moving body: everything the recursions need, side by side in memory.
#[expect(
    clippy::struct_field_names,
    reason = "a rotation names both of its frames"
)]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Body {
    pub motion: Motion,
    /// The body that carries it, always earlier in the list; `None` for the ground.
    pub parent: Option<usize>,
    /// Index of its joint in q, qd, qdd and tau.
    pub joint_idx: usize,
    /// Pose of the body's frame in its parent's at joint position 0.
    pub pose: Pose,
    /// All links of the body, about its joint's origin.
    pub inertia: BodyInertia,
    /// Turns coordinates of the body's frame into those of its joint's child link.
    pub rot_link_body: Matrix3<f64>,
}

/// What is known of a moving joint beyond its geometry.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Joint {
    pub kind: JointKind,
    pub limits: Option<Limits>,
}

/// A named frame: every link of the description has one.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Name of the link.
    pub name: String,
    /// The moving body it belongs to; `None` if no joint moves it.
    pub(crate) body_idx: Option<usize>,
    /// Pose in that body's frame, or in the root link's.
    pub(crate) pose: Pose,
}
