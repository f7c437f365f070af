#![doc = include_str!("../README.md")]

pub mod block;
pub mod context;
mod error;
pub mod fit;
pub mod latent;
pub mod novel;
pub mod prior;

pub use error::MtgpError;
pub use faer;
pub use fit::{
    Criterion, MultiTaskOptions, StageOne, TaskFit, choose_rank, fit_independent, fit_pooled,
    fit_ranks,
};
pub use gp_core;
pub use kernels;
pub use prior::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};
