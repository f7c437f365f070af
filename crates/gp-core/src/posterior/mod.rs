//! A Gaussian process conditioned on data: eqs. (3) and (4), on samples or on a few pivots.

mod basis;
mod condition;
mod covariance;
mod further_samples;
mod predict;

pub use basis::Basis;
pub use condition::Posterior;
pub use predict::Prediction;
