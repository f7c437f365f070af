//! What an arm carries, told from its torques one state after another.
//!
//! ```text
//! y = Y(π + Eψ) + φᵀθ + ε,   (π, θ) = (π̂, θ̂) + R z,   z ~ N(0, 1) as learned,   ψ what is asked for
//! ```
//! A [`stretch`] of ticks under one load takes z out of the rows as they come, so that what is left of them tells ψ:
//! ten numbers with their information H and b, from which the evidence of every known load and of one that is not
//! known follows. Younger stretches that began later say when the load has changed.
//!
//! # Source
//! Friedland 1969, "Treatment of bias in recursive filtering", for the two stages; Willsky & Jones 1976, "A
//! generalized likelihood ratio approach to the detection and estimation of jumps in linear systems", for changes.

mod arm_basis;
mod lanes;
mod load_belief;
mod load_factor;
mod online_load;
mod outer_products;
mod settings;
mod stretch;
mod tick_rows;

pub use online_load::{LoadEstimate, OnlineLoad};
pub use settings::OnlineSettings;
