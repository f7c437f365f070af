//! The commands, one file each.

pub mod inverse_dynamics;
pub mod simulate;
