//! Models in the form that a control loop asks, one state at a time.

mod linear;
#[allow(
    clippy::module_inception,
    reason = "the file is named after its one type"
)]
mod predictor;
mod process;
mod regressor;
mod shared;

pub use predictor::{Predictor, Scratch};
