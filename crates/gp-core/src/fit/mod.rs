//! Learning: hyperparameters by the highest likelihood, and the process conditioned on the data.

mod chapter_start;
mod covariance;
mod linear;
mod linear_evidence;
mod rigid_body;
mod stacked_system;
mod torque;

pub use chapter_start::{chapter_start, varied_start};
pub use covariance::{Fit, fit_covariance};
pub use linear::{BayesLinear, LINEAR_NOISE_VAR, LinearForm, WEIGHT_VAR};
pub use rigid_body::{
    InformedFit, ParameterPrior, RegressorSamples, RigidBodyAndProcess, RigidBodyCovariance,
    fit_informed, fit_rigid_body, fit_rigid_body_and_process,
};
pub use torque::{fit, fit_from};
