//! `torque-gp inspect`: what a model file says of itself.

mod command;
mod description;
mod parameters;

pub use command::{Args, run};
