#![doc = include_str!("../README.md")]

mod cholesky;
mod columns;
mod error;
mod in_place;
mod orthogonal;
mod packed_lower;
mod products;
mod spectral;
pub mod sums;
mod threads;
mod tiled;
mod triangular_rows;
mod vector_exp;
mod window_factor;

pub use cholesky::Factor;
pub use columns::{column_mut, for_each_column};
pub use error::LinalgError;
pub use orthogonal::{Orthogonal, upper_of};
pub use packed_lower::PackedLower;
pub use products::{add_inner_product, mirror, product};
pub use spectral::{SymmetricEigen, ThinSvd, symmetric_eigen, thin_svd};
pub use threads::{Threads, column_panels, row_panels};
pub use triangular_rows::TriangularRows;
pub use vector_exp::{exp, exp_in_place};
pub use window_factor::WindowFactor;
