//! What the chapter simulates: the PUMA 560 with its closed-form inverse kinematics, the paths its
//! tool follows, and the loads it carries ([`Scenario`]).

pub(crate) mod inverse_kin;
pub(crate) mod inverse_rates;
pub(crate) mod path;
pub mod puma560;
pub(crate) mod scenario;
pub(crate) mod scenario_file;
pub(crate) mod trajectory;

pub use inverse_kin::{Arm, Branch, Elbow, Wrist, inverse_kinematics};
pub use inverse_rates::{JointMotion, inverse_rates};
pub use path::{FigureOfEight, PointMotion, Tool};
pub use scenario::{RangeExcess, Scenario};
pub use trajectory::Trajectory;
