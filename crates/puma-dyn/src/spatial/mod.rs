//! Three-vectors, rotations and rigid transforms, and the ten inertial parameters of a rigid body.
//!
//! Everything else in this crate is built from four operations defined here: composing poses, the
//! cross product as a matrix, moving inertial parameters to another frame, and adding them up.

pub(crate) mod dh;
pub(crate) mod inertia;
pub(crate) mod pose;

pub use dh::DhLink;
pub use pose::{Pose, rotation_from_rpy, rotation_x, rotation_y, rotation_z, skew};
