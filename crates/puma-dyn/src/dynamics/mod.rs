//! What a state of a robot asks for: torques, accelerations, their parts, and where its frames are.

pub(crate) mod aba;
pub(crate) mod articulated;
pub(crate) mod check;
pub(crate) mod crba;
pub(crate) mod drive_regressor;
pub(crate) mod energy;
pub(crate) mod forward_kin;
pub(crate) mod friction;
pub(crate) mod hysteresis;
pub(crate) mod jacobian;
pub(crate) mod kinematics;
pub(crate) mod parameter_spread;
pub(crate) mod payload;
pub(crate) mod regressor;
pub(crate) mod rnea;
pub(crate) mod terms;
pub(crate) mod unit_motion;
pub(crate) mod workspace;

pub use aba::aba;
pub use crba::crba;
pub use drive_regressor::{
    N_DRIVE_PARAMETERS, drive_parameters, drive_regressor, full_regressor, parameters_of_joint,
};
pub use energy::{kinetic_energy, potential_energy};
pub use forward_kin::forward_kinematics;
pub use friction::coulomb_torques;
pub use hysteresis::Hysteresis;
pub use jacobian::{FrameMotion, bias_acceleration, jacobian};
pub use parameter_spread::ParameterSpread;
pub use payload::{AttachedPayload, Context, Payload};
pub use regressor::{N_PARAMETERS, inertial_parameters, regressor};
pub use rnea::{rnea, rnea_with_hysteresis};
pub use terms::{
    TorqueTerms, coriolis_torques, gravity_torques, torque_terms, torque_terms_with_hysteresis,
};
pub use workspace::Workspace;
