#![doc = include_str!("../README.md")]

mod audible;
mod constant;
mod coulomb;
mod covariance;
mod error;
mod features;
mod jitter;
mod linear_ard;
mod on_columns;
mod params;
mod positive;
mod rigid_body;
mod se_ard;
mod se_ard_adjoint;
mod sum;
mod torque;

pub use constant::Constant;
pub use coulomb::{Coulomb, sgn};
pub use covariance::Covariance;
pub use error::KernelError;
pub use jitter::Jitter;
pub use linear_ard::LinearArd;
pub use on_columns::OnColumns;
pub use params::{
    Component, LINEAR_STD_CEILING, NOISE_VAR_FLOOR, ParamLayout, ParamSpec, Transform,
};
pub use rigid_body::RigidBody;
pub use se_ard::SeArd;
pub use sum::Sum;
pub use torque::{TorqueCovariance, TorqueForm, TorqueParams};
