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
    Likelihood, LikelihoodOptions, LogMarginal, Method, MethodUsed, log_marginal_likelihood,
};
pub use faer;
pub use fit::{BayesLinear, Fit, LinearForm, fit};
pub use kernels;
pub use posterior::{Basis, Posterior, Prediction};
pub use search::{FitOptions, Starts};
