//! What a robot is: plain data ([`RobotDescription`]), read from URDF and a sidecar, checked once and
//! from then on immutable ([`Model`]).

pub(crate) mod body;
pub(crate) mod description;
pub(crate) mod friction_law;
pub(crate) mod friction_term;
pub(crate) mod model;
pub(crate) mod sidecar;
pub(crate) mod smooth_friction;
pub(crate) mod text_file;
pub(crate) mod urdf;
pub(crate) mod validate;
pub(crate) mod warning;

pub use body::Frame;
pub use description::{
    Drive, GRAVITY, Inertial, JointDescription, JointKind, Limits, LinkDescription,
    RobotDescription,
};
pub use friction_law::{Effects, Friction};
pub use friction_term::{DriveState, FrictionTerm, next_hysteresis};
pub use model::Model;
pub use sidecar::{JointKeys, Sidecar};
pub use smooth_friction::{
    HysteresisFriction, LoadHysteresisFriction, SmoothFriction, TanhFriction,
};
pub use urdf::{JointDynamics, Loaded, load_urdf, parse_urdf, write_urdf};
pub use warning::{PhysicalWarning, Warning};
