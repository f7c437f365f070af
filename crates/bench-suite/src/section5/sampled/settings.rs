//! How many draws there are, in each profile.

use serde::Deserialize;

/// Settings of a profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    pub n_total: usize,
    pub joints: Vec<usize>,
    pub n_chains: u64,
    pub n_warmup: usize,
    pub n_draws: usize,
    pub max_depth: u32,
    pub target_acceptance: f64,
    pub n_mixture: usize,
    pub n_test: usize,
}
