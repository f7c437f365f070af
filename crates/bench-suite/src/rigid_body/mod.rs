//! The informative prior of section 3.2, learned for one joint: torque that is linear in the parameters
//! of a rigid-body model of the arm, alone and with a process on what it leaves.
//!
//! # Source
//! Section 3.2: "a Gaussian prior on the inertial parameters … highly informative".

mod learned;
pub mod parameters;
pub mod rows;

pub use learned::{JointModel, RigidBodyFit};
pub use torque_model::learn::RigidBodyForm;
