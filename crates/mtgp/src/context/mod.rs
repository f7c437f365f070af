//! Which context made given torques: eq. (21), in batch and on-line, and the answer that none of them did.

mod estimate;
mod filter;
mod model;
mod outliers;
mod torque_noise;
mod tracker;
mod unknown;
mod window;

pub use estimate::{
    ContextEvidence, ContextPosterior, ContextPrior, JointTorques, context_evidence,
};
pub use filter::{ContextFilter, ContextTransition};
pub use model::ContextModel;
pub use outliers::Outliers;
pub use torque_noise::WithTorqueNoise;
pub use tracker::ContextTracker;
pub use unknown::{
    Calibration, ContextAnswer, chi_squared_upper_tail, known_or_unknown, largest_p_value,
};
