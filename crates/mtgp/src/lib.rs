#![doc = include_str!("../README.md")]

mod all_tasks;
mod baselines;
mod bic;
pub mod block;
mod climb;
pub mod context;
mod error;
mod ladder;
pub mod latent;
mod model;
pub mod novel;
pub mod prior;
mod rank_part;
mod shared_factor;
mod staged;
mod task_fit;
mod task_start;

pub use baselines::{fit_independent, fit_pooled, fit_separate};
pub use bic::{
    Criterion, RankCandidate, RankChoice, RankCounts, choose_rank, choose_rank_per_joint,
};
pub use error::MtgpError;
pub use ladder::{fit_ranks, fit_ranks_telling};
pub use model::{ContextPredictor, ModelParts, MultiTaskModel, RankSelection, TaskProcess};
pub use prior::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};
pub use rank_part::{RankPart, rank_part};
pub use shared_factor::{JointStart, SharedFit, fit_shared};
pub use staged::{StageOne, fit_rank, fit_rank_from};
pub use task_fit::{MultiTaskOptions, Origin, TaskFit, TaskFitReport, TaskStart};
pub use task_start::{AugmentedTargets, augmented_k_task, augmented_targets};
