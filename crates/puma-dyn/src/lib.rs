#![doc = include_str!("../README.md")]
//!
//! ## Where to look
//!
//! - [`rnea`], [`crba`], [`aba`]: torques from motion, the inertia matrix, motion from torques.
//! - [`torque_terms`], [`gravity_torques`], [`coriolis_torques`], [`kinetic_energy`],
//!   [`potential_energy`]: the parts.
//! - [`forward_kinematics`], [`jacobian`], [`bias_acceleration`]: where a frame is and how it moves.
//! - [`regressor`], [`inertial_parameters`]: torques as a linear function of masses and inertias.
//! - [`ArmSimulator`], [`ClosedLoop`]: the arm in motion, with friction that holds and slips, and under
//!   a [`CompositeController`] with any [`FeedForward`].
//! - [`load_urdf`], [`parse_urdf`], [`RobotDescription`]: robots of your own.
//! - [`puma560`], [`inverse_kinematics`], [`Scenario`]: the built-in arm and its data set.
//!
//! A [`Model`] is immutable and can be shared between threads; each thread has its [`Workspace`].

mod aba;
mod arm_simulator;
mod closed_loop;
mod compliant_wall;
mod controller;
mod crba;
mod description;
mod dh;
mod drive_regressor;
mod energy;
mod error;
mod feed_forward;
mod forward_kin;
mod friction;
mod inverse_kin;
mod inverse_rates;
mod jacobian;
mod kinematics;
mod model;
mod parameter_spread;
mod path;
mod payload;
pub mod puma560;
mod reference_motion;
mod regressor;
mod rnea;
mod scenario;
mod scenario_file;
mod sidecar;
mod slip_dynamics;
mod spatial;
mod stick_slip;
mod terms;
mod toml_place;
mod trajectory;
mod urdf;
mod validate;
mod warning;
mod workspace;

pub use aba::aba;
pub use arm_simulator::{ArmSimulator, Work};
pub use closed_loop::{ClosedLoop, Rate, Tick};
pub use compliant_wall::CompliantWall;
pub use controller::CompositeController;
pub use crba::crba;
pub use description::{
    Drive, GRAVITY, Inertial, JointDescription, JointKind, Limits, LinkDescription,
    RobotDescription,
};
pub use dh::DhLink;
pub use drive_regressor::{N_DRIVE_PARAMETERS, drive_parameters, drive_regressor, full_regressor};
pub use energy::{kinetic_energy, potential_energy};
pub use error::DynError;
pub use feed_forward::{FeedForward, GravityFeedForward, ModelFeedForward, NoFeedForward};
pub use forward_kin::forward_kinematics;
pub use friction::{Effects, Friction, coulomb_torques};
pub use inverse_kin::{Arm, Branch, Elbow, Wrist, inverse_kinematics};
pub use inverse_rates::{JointMotion, inverse_rates};
pub use jacobian::{FrameMotion, bias_acceleration, jacobian};
pub use model::{Frame, Model, PhysicalWarning};
pub use nalgebra;
pub use parameter_spread::ParameterSpread;
pub use path::{FigureOfEight, PointMotion, Tool};
pub use payload::{AttachedPayload, Context, Payload};
pub use reference_motion::{JointState, ReferenceMotion};
pub use regressor::{N_PARAMETERS, inertial_parameters, regressor};
pub use rnea::rnea;
pub use scenario::{RangeExcess, Scenario};
pub use sidecar::Sidecar;
pub use spatial::{Pose, rotation_from_rpy, rotation_x, rotation_y, rotation_z, skew};
pub use stick_slip::SlipMode;
pub use terms::{TorqueTerms, coriolis_torques, gravity_torques, torque_terms};
pub use trajectory::Trajectory;
pub use urdf::{Loaded, load_urdf, parse_urdf};
pub use warning::Warning;
pub use workspace::Workspace;
