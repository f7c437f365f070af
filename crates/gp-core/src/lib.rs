#![doc = include_str!("../README.md")]

mod bayes_linear;
mod candidate;
mod covariance_fit;
mod data;
mod dense;
mod error;
mod evidence;
mod fisher;
mod fit;
mod fit_report;
mod init;
mod log_marginal;
mod low_rank;
mod model;
mod nested;
mod opening;
pub mod optimize;
mod pivot_choice;
mod pivoted;
mod posterior;
mod rigid_body_fit;
pub mod sampling;
mod search;
mod search_ends;
mod search_metric;

pub use bayes_linear::{BayesLinear, LINEAR_NOISE_VAR, LinearForm, WEIGHT_VAR};
pub use covariance_fit::{CovarianceFit, fit_covariance};
pub use error::GpError;
pub use evidence::{Evaluation, Evidence, LikelihoodOptions, Method, MethodUsed, evidence};
pub use fit::{Fit, FitOptions, SearchScheme, Starts, fit, fit_from};
pub use fit_report::{FitReport, StageReport, StartReport};
pub use init::{StartKind, StartPoint, chapter_start, varied_start};
pub use linalg::Factor;
pub use log_marginal::{
    LogMarginal, log_marginal_likelihood, log_marginal_likelihood_with_gradient,
};
pub use model::{
    FORMAT_VERSION, FitSummary, InformedModel, InformedRecord, JointModel, JointPrediction,
    ModelFileError, ModelFileKind, ModelKind, ParamsRecord, PosteriorRecord, Predictor,
    PredictorScratch, ProcessModel, ProcessPredictor, Provenance, ProvenanceRecord, RangesRecord,
    Scaling, SummaryRecord, TorqueModel, TrainingRanges, decode_model, encode_model,
};
pub use nested::spread_rows;
pub use optimize::StopReason;
pub use posterior::{Basis, Posterior, Prediction};
pub use rigid_body_fit::{
    InformedFit, ParameterPrior, RegressorSamples, RigidBodyAndProcess, RigidBodyCovariance,
    fit_informed, fit_rigid_body, fit_rigid_body_and_process,
};
pub use search::{Likelihood, SearchEnd, refine, search, search_near};
pub use search_ends::{highest, no_usable_start};
pub use search_metric::{add_prior_information, information};
