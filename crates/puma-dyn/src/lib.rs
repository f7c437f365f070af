//! Rigid-body dynamics of robot arms, with motors, friction and payloads, and the PUMA 560 built in.

mod description;
mod dh;
mod error;
mod friction;
mod model;
pub mod puma560;
mod sidecar;
mod spatial;
mod urdf;
mod validate;
mod warning;

pub use description::{
    Drive, GRAVITY, Inertial, JointDescription, JointKind, Limits, LinkDescription,
    RobotDescription,
};
pub use dh::DhLink;
pub use error::DynError;
pub use friction::{Effects, Friction};
pub use model::{Frame, Model, PhysicalWarning};
pub use nalgebra;
pub use sidecar::Sidecar;
pub use spatial::{Pose, rotation_from_rpy, rotation_x, rotation_y, rotation_z, skew};
pub use urdf::{Loaded, load_urdf, parse_urdf};
pub use warning::Warning;
