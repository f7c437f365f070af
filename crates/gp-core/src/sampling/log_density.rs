//! What a sampler draws from.

use crate::error::GpError;

/// A density over Rᵈ, up to a constant factor, with the gradient of its logarithm.
pub trait LogDensity {
    /// d.
    fn dimension(&self) -> usize;

    /// Natural logarithm of the density at z, and its gradient.
    ///
    /// # Errors
    /// Where there is no value: the density counts as zero there.
    /// # Panics
    /// If `z` or `gradient` does not have d entries.
    fn evaluate(&mut self, z: &[f64], gradient: &mut [f64]) -> Result<f64, GpError>;
}
