#![doc = include_str!("../README.md")]

mod adapted_posterior;
mod all_tasks;
mod basis;
mod context_estimate;
mod context_filter;
mod context_tracker;
mod error;
pub mod fit;
mod integrated_block;
mod kron;
mod latent_functions;
mod latent_predictor;
mod layout;
mod matrix_root;
mod model;
mod noise_free;
mod novel_context;
mod outliers;
mod predictive;
mod prior;
mod repeated_inputs;
mod row_population;
mod runs;
mod sample_window;
mod sequential;
mod structured_prediction;
mod task_cov;
mod task_noise;
mod task_pairs;
mod task_prior;
mod task_regression;
mod task_row;
mod torque_noise;
mod triangular_rows;
mod unknown_context;
mod window_factor;

pub use adapted_posterior::AdaptedPosterior;
pub use context_estimate::{
    ContextEvidence, ContextPosterior, ContextPrior, JointTorques, context_evidence,
};
pub use context_filter::{ContextFilter, ContextTransition};
pub use context_tracker::ContextTracker;
pub use error::MtgpError;
pub use fit::{
    AugmentedTargets, Criterion, MultiTaskOptions, RankCandidate, RankChoice, RankCounts, RankPart,
    SharedFit, StageOne, TaskFit, augmented_k_task, augmented_targets, choose_rank,
    choose_rank_per_joint, fit_independent, fit_pooled, fit_rank, fit_rank_from, fit_ranks,
    fit_ranks_telling, fit_separate, fit_shared, rank_part,
};
pub use integrated_block::{IntegratedBlock, StudentT};
pub use kron::{BlockGradient, CompleteBlock};
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
pub use repeated_inputs::{FactorGradient, RepeatedInputs, SharedObservations};
pub use row_population::RowPopulation;
pub use task_cov::{TaskCovariance, TaskFactor};
pub use task_noise::{TaskNoise, TaskNoisePosterior};
pub use task_prior::{TaskMeasure, TaskPrior, WithTaskPrior};
pub use task_regression::TaskRegression;
pub use task_row::TaskRow;
pub use torque_noise::WithTorqueNoise;
pub use unknown_context::{
    Calibration, ContextAnswer, chi_squared_upper_tail, known_or_unknown, largest_p_value,
};
