#![doc = include_str!("../README.md")]

mod adapt;
mod error;
pub mod file;
mod fit_summary;
mod joint_model;
pub mod learn;
mod parts;
mod prediction;
mod predictor;
mod process;
mod provenance;
mod ranges;
mod robot_model;
mod robot_source;
mod rows;
mod samples;

pub use adapt::{Adapt, adapt, adapt_joint};
pub use error::TorqueError;
pub use faer;
pub use file::{ModelFileError, ModelFileKind};
pub use fit_summary::FitSummary;
pub use gp_core;
pub use joint_model::JointModel;
pub use kernels;
pub use learn::Learn;
pub use parts::{ModelParts, RankSelection};
pub use prediction::JointPrediction;
pub use predictor::{Predictor, Scratch};
pub use process::{Process, TaskProcess, TorqueFunction};
pub use provenance::Provenance;
pub use ranges::TrainingRanges;
pub use robot_model::RobotModel;
pub use robot_source::{Robot, RobotSource};
pub use rows::{RegressorRows, Rows, States, TaskRows};
pub use samples::{JointTorques, Samples};
