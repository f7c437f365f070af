#![doc = include_str!("../README.md")]

mod error;
mod kron;
mod layout;
mod model;
mod noise_free;
mod prior;
mod repeated_inputs;
mod runs;
mod sequential;
mod structured_prediction;
mod task_cov;
mod task_noise;

pub use error::MtgpError;
pub use kron::{BlockGradient, CompleteBlock};
pub use layout::{Stacked, with_task};
pub use model::{ContextPredictor, ModelParts, MultiTaskModel, RankSelection, TaskProcess};
pub use noise_free::NoiseFreeBlock;
pub use prior::MultiTaskCovariance;
pub use repeated_inputs::{FactorGradient, RepeatedInputs, SharedObservations};
pub use task_cov::{TaskCovariance, TaskFactor};
pub use task_noise::{TaskNoise, TaskNoisePosterior};
