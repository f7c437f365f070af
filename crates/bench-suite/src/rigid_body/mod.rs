//! The informative prior of section 3.2: torque that is linear in the parameters of a rigid-body model of the arm,
//! learned for one joint, alone and with a process on what it leaves, and for all joints together.
//!
//! # Source
//! Section 3.2: "a Gaussian prior on the inertial parameters … highly informative".

mod learned;
pub mod parameters;
pub mod rows;
pub mod shared;

pub use learned::{JointModel, RigidBodyFit};
pub use shared::Terms;
pub use torque_model::learn::RigidBodyForm;

/// A way to learn with the prior of section 3.2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RigidBodyKind {
    /// Each joint by itself, with parameters of its own.
    OfJoint(RigidBodyForm),
    /// All joints together, with parameters that they share.
    OfRobot(Terms),
}
