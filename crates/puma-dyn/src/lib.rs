#![doc = include_str!("../README.md")]
//!
//! ## Where to look
//!
//! What a first program needs stands here; everything, this included, is in five modules:
//!
//! - [`robot`]: robots of your own, from URDF or plain data ([`load_urdf`], [`RobotDescription`]), checked
//!   once ([`Model`]).
//! - [`dynamics`]: torques from motion ([`rnea`]), the inertia matrix ([`crba`]), motion from torques
//!   ([`aba`]); the parts of a torque ([`torque_terms`]) and the energies; where a frame is and how it
//!   moves ([`forward_kinematics`], [`jacobian`]); torques as a linear function of masses and inertias
//!   ([`regressor`]).
//! - [`motion`]: the arm in motion, with friction that holds and slips ([`motion::ArmSimulator`]), and
//!   under a controller with any feed-forward ([`motion::ClosedLoop`]).
//! - [`chapter`]: the built-in arm ([`puma560`]), its inverse kinematics, and its data set
//!   ([`Scenario`]).
//! - [`spatial`]: rotations and rigid transforms ([`Pose`]).
//!
//! A [`Model`] is immutable and can be shared between threads; each thread has its [`Workspace`].

pub mod chapter;
pub mod dynamics;
mod error;
pub mod motion;
pub mod robot;
pub mod spatial;

pub use chapter::{Scenario, puma560};
pub use dynamics::{
    Context, Payload, TorqueTerms, Workspace, aba, crba, forward_kinematics, jacobian, regressor,
    rnea, torque_terms,
};
pub use error::DynError;
pub use nalgebra;
pub use robot::{
    Effects, Friction, Loaded, Model, RobotDescription, Sidecar, Warning, load_urdf, parse_urdf,
};
pub use spatial::Pose;
