#![doc = include_str!("../README.md")]

pub mod data;
mod error;
pub mod evidence;
pub mod fit;
pub mod optimize;
pub mod posterior;
pub mod sampling;
pub mod search;

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
pub use linalg::Factor;
pub use optimize::StopReason;
pub use posterior::{Basis, Posterior, Prediction};
pub use search::{
    Distance, FitOptions, FitReport, Found, Limits, Origin, Plan, SearchEnd, SearchScheme, Stage,
    StageReport, Start, StartReport, Starts, climb, refine, search,
};
