//! `torque-gp fit`: learns joint torques from a CSV of measured states and torques.

mod args;
mod command;
mod learner;
mod progress;
mod report;

pub use args::Args;
pub use command::run;
