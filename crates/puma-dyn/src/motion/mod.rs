//! The arm in motion: friction that holds and slips, a controller at its ticks, a wall in the way.

pub(crate) mod arm_simulator;
pub(crate) mod closed_loop;
pub(crate) mod compliant_wall;
pub(crate) mod controller;
pub(crate) mod feed_forward;
pub(crate) mod reference_motion;
pub(crate) mod slip_dynamics;
pub(crate) mod stick_slip;
pub(crate) mod tick;
pub(crate) mod torque_noise;
pub(crate) mod travel_memory;

pub use arm_simulator::{ArmSimulator, Work};
pub use closed_loop::ClosedLoop;
pub use compliant_wall::CompliantWall;
pub use controller::CompositeController;
pub use feed_forward::{FeedForward, GravityFeedForward, ModelFeedForward, NoFeedForward};
pub use reference_motion::{JointState, ReferenceMotion};
pub use stick_slip::SlipMode;
pub use tick::{Rate, Tick};
pub use torque_noise::TorqueNoise;
