//! The latent functions of eq. (16) at new inputs, and the density of torques there.

mod all_tasks;
mod latent_functions;
mod latent_predictor;
mod predictive;
mod whitening;

pub use all_tasks::predict_mean_of_all_tasks;
pub use latent_functions::LatentFunctions;
pub(crate) use latent_predictor::{LatentPredictor, LatentSample};
pub use predictive::PredictiveDensity;
pub(crate) use predictive::require_torques;
pub(crate) use whitening::{add_transposed_product, points_of};
