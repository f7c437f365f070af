//! How a log marginal likelihood is to be computed, and one value of it with a bound on its error.

use std::fmt;

/// How eq. (8) may be computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// By the low-rank path where its rank is a small part of n, else densely.
    Automatic,
    /// By a Cholesky factorisation of the whole matrix, O(n³).
    Dense,
    /// By the low-rank path, O(n r²), whatever its rank.
    Certified,
}

/// How eq. (8) was computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MethodUsed {
    /// By a Cholesky factorisation of the whole matrix.
    Dense,
    /// By the low-rank path with its certificate.
    Certified,
}

impl fmt::Display for MethodUsed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Dense => "dense",
            Self::Certified => "certified",
        })
    }
}

/// How the likelihood is to be computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LikelihoodOptions {
    /// Dense, low-rank, or whichever is faster.
    pub method: Method,
    /// Largest error of the log marginal likelihood that the low-rank path may make
    /// by leaving something out, in nats. Rounding comes on top.
    pub certificate: f64,
}

impl LikelihoodOptions {
    /// The dense path.
    pub fn dense() -> Self {
        Self {
            method: Method::Dense,
            certificate: CERTIFICATE,
        }
    }

    /// Whichever path is faster, with an error of at most 10⁻⁴ nats; 0.1 nats beyond 16,384 samples,
    /// where there is no dense path.
    pub fn automatic() -> Self {
        Self {
            method: Method::Automatic,
            ..Self::dense()
        }
    }
}

/// Nats that a search for the highest likelihood does not see.
const CERTIFICATE: f64 = 1e-4;

/// One value of eq. (8).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evaluation {
    /// Log marginal likelihood, natural log, summed over the data.
    pub log_marginal_likelihood: f64,
    /// Bound on its error, in nats: what the low-rank path leaves out, and what
    /// rounding the entries of K leaves in either path.
    pub error_bound: f64,
    /// The path taken.
    pub method: MethodUsed,
    /// Rank of the factor: n if dense.
    pub rank: usize,
}
