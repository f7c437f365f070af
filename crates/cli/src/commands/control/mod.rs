//! `torque-gp control`: a robot that follows a motion under the composite controller, simulated.

mod command;
mod feed_forward;
mod gains;
mod reference;
mod summary;

pub use command::{Args, run};
