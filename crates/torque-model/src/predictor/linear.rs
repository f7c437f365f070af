//! One linear model at one state.

use gp_core::fit::{BayesLinear, LinearForm};
use linalg::PackedLower;
use linalg::sums::dot_pairwise;

/// A linear model ready to be asked at one state.
///
/// ```text
/// mean = x̃ᵀE[β],  var = σ²|R⁻ᵀx̃|²
/// ```
#[derive(Debug, Clone)]
pub(crate) struct LinearPredictor {
    form: LinearForm,
    weights: Vec<f64>,
    r_transposed: PackedLower,
    noise_var: f64,
}

impl LinearPredictor {
    pub fn new(linear: &BayesLinear) -> Self {
        Self {
            form: linear.form(),
            weights: linear.weights().to_vec(),
            r_transposed: PackedLower::of(linear.r().transpose()),
            noise_var: linear.noise_var(),
        }
    }

    /// Number p of features.
    pub fn n_features(&self) -> usize {
        self.weights.len()
    }

    /// Mean and latent variance at x, with `signs` = sgn q̇ and scratch of p entries.
    pub fn predict(&self, x: &[f64], signs: &[f64], features: &mut [f64]) -> (f64, f64) {
        features[..x.len()].copy_from_slice(x);
        let n_signs = match self.form {
            LinearForm::Smooth => 0,
            LinearForm::Coulomb => signs.len(),
        };
        features[x.len()..x.len() + n_signs].copy_from_slice(&signs[..n_signs]);
        features[x.len() + n_signs] = 1.0;

        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let mean = dot_pairwise(&self.weights, features);
                self.r_transposed.solve_in_place(features);
                (mean, self.noise_var * dot_pairwise(features, features))
            },
        )
    }
}
