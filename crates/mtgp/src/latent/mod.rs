//! The latent functions of eq. (16) at new inputs, and the density of torques there.

mod latent_functions;
mod predictive;

pub use latent_functions::LatentFunctions;
pub use predictive::PredictiveDensity;
pub(crate) use predictive::require_torques;
