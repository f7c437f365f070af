#![doc = include_str!("../README.md")]

mod constant;
mod continuous;
mod coulomb;
mod covariance;
mod error;
mod features;
mod jitter;
#[cfg(feature = "laws")]
pub mod laws;
mod linear_ard;
mod on_columns;
pub mod params;
mod positive;
mod revived;
mod rigid_body;
mod se_ard;
mod sum;
mod torque;
mod torque_params;

pub use constant::Constant;
pub use continuous::{ContinuousJoints, Embedded};
pub use coulomb::{Coulomb, sgn};
pub use covariance::Covariance;
pub use error::KernelError;
pub use faer;
pub use jitter::Jitter;
pub use linear_ard::LinearArd;
pub use on_columns::OnColumns;
pub use params::{ParamLayout, Transform};
pub use rigid_body::RigidBody;
pub use se_ard::SeArd;
pub use sum::Sum;
pub use torque::TorqueCovariance;
pub use torque_params::{TorqueForm, TorqueParams};
