//! The squared-exponential term of eq. (5), one length scale per covariate.

mod adjoint;
mod correlations;
mod squared_exponential;

pub use squared_exponential::SeArd;
