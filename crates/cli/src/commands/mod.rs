//! The commands, one file each.

pub mod adapt;
pub mod context;
pub mod control;
pub mod evaluate;
pub mod export;
pub mod fit;
pub mod inspect;
pub mod inverse_dynamics;
pub mod likelihood;
pub mod predict;
pub mod prepare;
pub mod sample;
pub mod simulate;
