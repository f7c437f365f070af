#![doc = include_str!("../README.md")]

mod adapted_posterior;
mod all_tasks;
mod baselines;
mod basis;
mod bic;
mod climb;
mod context_estimate;
mod context_filter;
mod context_tracker;
mod error;
mod kron;
mod ladder;
mod latent_functions;
mod latent_predictor;
mod layout;
mod model;
mod noise_free;
mod novel_context;
mod outliers;
mod predictive;
mod prior;
mod rank_part;
mod row_population;
mod runs;
mod sample_window;
mod sequential;
mod shared_factor;
mod staged;
mod structured_prediction;
mod task_cov;
mod task_fit;
mod task_noise;
mod task_pairs;
mod task_regression;
mod task_row;
mod task_start;
mod torque_noise;
mod triangular_rows;
mod unknown_context;
mod window_factor;

pub use adapted_posterior::AdaptedPosterior;
pub use baselines::{fit_independent, fit_pooled, fit_separate};
pub use bic::{
    Criterion, RankCandidate, RankChoice, RankCounts, choose_rank, choose_rank_per_joint,
};
pub use context_estimate::{
    ContextEvidence, ContextPosterior, ContextPrior, JointTorques, context_evidence,
};
pub use context_filter::{ContextFilter, ContextTransition};
pub use context_tracker::ContextTracker;
pub use error::MtgpError;
pub use kron::{BlockGradient, CompleteBlock};
pub use ladder::{fit_ranks, fit_ranks_telling};
pub use latent_functions::LatentFunctions;
pub use layout::{Stacked, with_task};
pub use model::{ContextPredictor, ModelParts, MultiTaskModel, RankSelection, TaskProcess};
pub use noise_free::NoiseFreeBlock;
pub use novel_context::{
    Border, NewTorques, RowFit, fit_row, fit_row_from_population, log_density_of_row,
    log_density_of_row_with_gradient,
};
pub use outliers::Outliers;
pub use predictive::{ContextModel, PredictiveDensity};
pub use prior::MultiTaskCovariance;
pub use rank_part::{RankPart, rank_part};
pub use row_population::RowPopulation;
pub use shared_factor::{JointStart, SharedFit, fit_shared};
pub use staged::{StageOne, fit_rank, fit_rank_from};
pub use task_cov::{TaskCovariance, TaskFactor};
pub use task_fit::{MultiTaskOptions, Origin, TaskFit, TaskFitReport, TaskStart};
pub use task_noise::TaskNoise;
pub use task_regression::TaskRegression;
pub use task_row::TaskRow;
pub use task_start::{AugmentedTargets, augmented_k_task, augmented_targets};
pub use torque_noise::WithTorqueNoise;
pub use unknown_context::{
    Calibration, ContextAnswer, chi_squared_upper_tail, known_or_unknown, largest_p_value,
};
