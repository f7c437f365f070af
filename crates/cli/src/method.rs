//! The choice between the two ways to compute a likelihood.

use clap::ValueEnum;
use gp_core::Method;

/// How the covariance matrix of a Gaussian process is factorised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// Certified where its rank is a small part of the rows, else dense
    Automatic,
    /// Cholesky factor of the whole matrix: time n³
    Dense,
    /// Factor of low rank r with a bound on the error it makes: time n r²
    Certified,
}

impl MethodArg {
    /// The library's name for it.
    pub fn method(self) -> Method {
        match self {
            Self::Automatic => Method::Automatic,
            Self::Dense => Method::Dense,
            Self::Certified => Method::Certified,
        }
    }
}
