//! `torque-gp context`: which of a model's contexts measured torques come from.

mod command;
mod evidence;
mod held_out;
mod loads;
mod online;

pub use command::{Args, run};
