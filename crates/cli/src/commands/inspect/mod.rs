//! `torque-gp inspect`: what a model file says of itself.

mod command;
mod description;

pub use command::{Args, run};
