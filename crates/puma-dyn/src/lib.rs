//! Rigid-body dynamics of robot arms, with motors, friction and payloads, and the PUMA 560 built in.

mod description;
mod dh;
mod error;
mod friction;
mod inverse_kin;
mod inverse_rates;
mod kinematics;
mod model;
mod payload;
mod path;
pub mod puma560;
mod rnea;
mod scenario;
mod scenario_file;
mod sidecar;
mod spatial;
mod trajectory;
mod urdf;
mod validate;
mod warning;
mod workspace;

pub use description::{
    Drive, GRAVITY, Inertial, JointDescription, JointKind, Limits, LinkDescription,
    RobotDescription,
};
pub use dh::DhLink;
pub use error::DynError;
pub use friction::{Effects, Friction};
pub use inverse_kin::{Arm, Branch, Elbow, Wrist, inverse_kinematics};
pub use inverse_rates::{JointMotion, inverse_rates};
pub use model::{Frame, Model, PhysicalWarning};
pub use nalgebra;
pub use path::{FigureOfEight, PointMotion, Tool};
pub use payload::{AttachedPayload, Context, Payload};
pub use rnea::rnea;
pub use scenario::{RangeExcess, Scenario};
pub use sidecar::Sidecar;
pub use spatial::{Pose, rotation_from_rpy, rotation_x, rotation_y, rotation_z, skew};
pub use trajectory::Trajectory;
pub use urdf::{Loaded, load_urdf, parse_urdf};
pub use warning::Warning;
pub use workspace::Workspace;
