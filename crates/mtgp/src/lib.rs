#![doc = include_str!("../README.md")]

mod error;
mod kron;
mod noise_free;
mod repeated_inputs;
mod sequential;
mod structured_prediction;

pub use error::MtgpError;
pub use kron::{BlockGradient, CompleteBlock};
pub use noise_free::NoiseFreeBlock;
pub use repeated_inputs::{FactorGradient, RepeatedInputs, SharedObservations};
