//! `torque-gp simulate`: states and torques of the PUMA 560 along the scenario's paths.

mod command;
pub mod run;

pub use command::{Args, run};
