#![doc = include_str!("../README.md")]

mod baselines;
mod bic;
mod climb;
mod error;
mod kron;
mod layout;
mod noise_free;
mod prior;
mod rank_part;
mod repeated_inputs;
mod runs;
mod sequential;
mod staged;
mod structured_prediction;
mod task_cov;
mod task_fit;
mod task_noise;
mod task_start;

pub use baselines::{fit_independent, fit_pooled, fit_separate};
pub use bic::{
    Criterion, RankCandidate, RankChoice, RankCounts, choose_rank, choose_rank_per_joint,
};
pub use error::MtgpError;
pub use kron::{BlockGradient, CompleteBlock};
pub use layout::{Stacked, with_task};
pub use noise_free::NoiseFreeBlock;
pub use prior::MultiTaskCovariance;
pub use rank_part::{RankPart, rank_part};
pub use repeated_inputs::{FactorGradient, RepeatedInputs, SharedObservations};
pub use staged::{StageOne, fit_rank, fit_rank_from};
pub use task_cov::{TaskCovariance, TaskFactor};
pub use task_fit::{MultiTaskOptions, Origin, TaskFit, TaskFitReport, TaskStart};
pub use task_noise::{TaskNoise, TaskNoisePosterior};
pub use task_start::{AugmentedTargets, augmented_k_task, augmented_targets};
