//! The model of a real robot: parameters shared by joints and loads, friction that remembers, honest error bars.
//!
//! ```text
//! y_j = Y_j(q, q̇, q̈)(π + E ψ_c) + φ_jᵀ θ_j + ε_j
//! ```
//! π are the inertial parameters of the links, one vector for all joints; ψ_c the ten of the load that context c
//! carries; φ_j friction terms of joint j; ε noise with a profile over speed, correlated within runs.
//! What is learned is one normal posterior, in closed form.

mod adapt;
mod carry;
mod choice;
mod consistency;
mod correlation;
pub use choice::TermChoice;
mod design;
mod evidence;
mod export;
mod fit;
mod identify;
mod log;
mod low_rank;
mod memory;
mod new_rows;
mod noise;
mod normal_equations;
mod online;
mod posterior;
mod prior;
mod shared_joint;
mod state_rows;
mod term_set;
mod unknowns;

#[cfg(test)]
mod golden;

pub use consistency::{nearest_bodies, nearest_body};
pub use correlation::LEAST_SECONDS;
pub(crate) use correlation::{RunRows, correlation, least_correlation, median};
pub use evidence::LoadEvidence;
pub use export::{IdentifiedLoad, IdentifiedRobot};
pub use fit::FitSettings;
pub use identify::{Fitted, fit};
pub use log::used_rows;
pub(crate) use log::{Run, runs_of};
pub use low_rank::LowRank;
pub(crate) use memory::states_with_memory;
pub use noise::{JointNoise, N_BINS, SPEED_EDGES, bin_of};
pub use online::{LoadEstimate, OnlineLoad, OnlineSettings};
pub use posterior::{LearnedJoint, ParameterPosterior, PosteriorParts};
pub use prior::{LOAD_STD, body_std, friction_std};
pub use shared_joint::SharedJoint;
pub use term_set::TermSet;
pub use unknowns::Unknowns;
