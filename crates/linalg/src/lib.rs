#![doc = include_str!("../README.md")]

mod columns;
pub mod sums;
mod threads;
mod vector_exp;

pub use columns::{column_mut, for_each_column};
pub use threads::{Threads, column_panels, row_panels};
pub use vector_exp::{exp, exp_in_place};
