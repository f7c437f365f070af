#![doc = include_str!("../README.md")]

mod cholesky;
mod data;
mod error;
pub mod evidence;
pub mod fit;
mod fit_posterior;
mod further_samples;
mod joint_covariance;
mod low_rank_posterior;
mod model;
pub mod optimize;
mod orthogonal;
mod posterior;
pub mod sampling;
pub mod search;
pub mod sequential;
mod tiled;

pub use cholesky::Factor;
pub use error::GpError;
pub use evidence::{
    Evaluation, Evidence, Likelihood, LikelihoodOptions, LogMarginal, Method, MethodUsed,
    add_prior_information, evidence, information, log_marginal_likelihood,
    log_marginal_likelihood_with_gradient, spread_rows,
};
pub use fit::{
    BayesLinear, Fit, InformedFit, LINEAR_NOISE_VAR, LinearForm, ParameterPrior, RegressorSamples,
    RigidBodyAndProcess, RigidBodyCovariance, WEIGHT_VAR, chapter_start, fit, fit_covariance,
    fit_from, fit_informed, fit_rigid_body, fit_rigid_body_and_process, varied_start,
};
pub use fit_posterior::FitPosterior;
pub use low_rank_posterior::{LowRankParts, LowRankPosterior};
pub use model::{
    FORMAT_VERSION, FitSummary, InformedModel, InformedRecord, JointModel, JointPrediction,
    ModelFileError, ModelFileKind, ModelKind, ParamsRecord, PosteriorRecord, Predictor,
    PredictorScratch, ProcessModel, ProcessPredictor, Provenance, ProvenanceRecord, RangesRecord,
    Scaling, SummaryRecord, TorqueModel, TrainingRanges, decode_model, encode_model,
};
pub use optimize::StopReason;
pub use posterior::{Posterior, Prediction};
pub use search::{
    Distance, FitOptions, FitReport, Found, Limits, Origin, Plan, SearchEnd, SearchScheme, Stage,
    StageReport, Start, StartReport, Starts, climb, refine, search,
};
