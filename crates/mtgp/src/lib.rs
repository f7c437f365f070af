#![doc = include_str!("../README.md")]

pub mod block;
pub mod context;
mod error;
pub mod fit;
pub mod latent;
pub mod novel;
pub mod prior;

pub use error::MtgpError;
pub use fit::{
    AugmentedTargets, Criterion, MultiTaskOptions, RankCandidate, RankChoice, RankCounts, RankPart,
    SharedFit, StageOne, TaskFit, augmented_k_task, augmented_targets, choose_rank,
    choose_rank_per_joint, fit_independent, fit_pooled, fit_rank, fit_rank_from, fit_ranks,
    fit_ranks_telling, fit_separate, fit_shared, rank_part,
};
pub use prior::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};
