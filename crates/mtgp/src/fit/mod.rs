//! Learning the torques of several tasks: A.3 and its baselines, on more and more of the data.

mod augmented_targets;
mod baselines;
mod described;
mod moments;
mod options;
mod parts;
mod rank_choice;
mod ranks;
mod shared_factor;
mod staged;
mod task_fit;

pub use crate::prior::{RankPart, rank_part};
pub use augmented_targets::{AugmentedTargets, augmented_k_task, augmented_targets};
pub use baselines::{fit_independent, fit_pooled};
pub use described::{Descriptors, fit_described};
pub use options::MultiTaskOptions;
pub use rank_choice::{Criterion, RankCandidate, RankChoice, RankCounts, choose_rank};
pub use ranks::{fit_ranks, fit_ranks_telling};
pub use shared_factor::{SharedFit, fit_shared};
pub use staged::{StageOne, fit_rank, fit_rank_from};
pub use task_fit::TaskFit;
