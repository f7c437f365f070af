#![doc = include_str!("../README.md")]

mod error;
mod layout;
mod prior;
mod runs;
mod task_cov;

pub use error::MtgpError;
pub use layout::{Stacked, with_task};
pub use prior::MultiTaskCovariance;
pub use task_cov::{TaskCovariance, TaskFactor};
