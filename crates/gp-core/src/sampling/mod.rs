//! Integration over hyperparameters by Hamiltonian Monte Carlo: density, sampler, diagnostics, mixtures.
//!
//! ```text
//! p(z | X, t) ∝ p(t | X, θ(z)) Π_i N(z_i; c_i, s_i²)      z: the unconstrained coordinates of θ and σ
//! p(t* | X, t) = ∫ p(t* | X, t, θ(z)) p(z | X, t) dz ≈ (1/S) Σ_s N(t*; mean_s, var_s)
//! ```
//! Source: sec. 5, "Markov chain Monte Carlo"; Neal 1997, "Monte Carlo implementation of Gaussian process
//! models".

mod chain_summary;
mod chains;
mod frame;
mod gaussian_mixture;
mod hyper_posterior;
mod laplace;
mod log_density;
mod normal;
mod nuts;

pub use chain_summary::{ChainSummary, split_r_hat};
pub use chains::sample_chains;
pub use gaussian_mixture::GaussianMixture;
pub use hyper_posterior::{HyperPosterior, HyperPrior};
pub use laplace::Laplace;
pub use log_density::LogDensity;
pub use normal::{normal_cdf, normal_quantile};
pub use nuts::{Chain, ChainOptions, sample_chain};
