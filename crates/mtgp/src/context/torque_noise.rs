//! Torques that are measured with more noise than those that were learned from.

use faer::MatRef;
use gp_core::Posterior;

use crate::context::model::ContextModel;
use crate::error::MtgpError;
use crate::latent::{LatentFunctions, PredictiveDensity};
use crate::prior::MultiTaskCovariance;

/// A joint's model whose new torques carry noise beyond the σ that was learned.
///
/// ```text
/// t* | D, c_γ ~ N(mean_γ, Σ_γ + (σ² + noise²)I)
/// ```
/// # Source
/// Eq. (21), with a sensor other than the one of the training data.
#[derive(Clone, Copy)]
pub struct WithTorqueNoise<'a> {
    /// The joint's model.
    pub posterior: &'a Posterior<MultiTaskCovariance>,
    /// Standard deviation of the noise that is not in σ, N·m.
    pub noise_std: f64,
}

impl ContextModel for WithTorqueNoise<'_> {
    fn n_contexts(&self) -> usize {
        self.posterior.covariance().n_tasks()
    }

    fn predictive_densities(
        &self,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<PredictiveDensity>, MtgpError> {
        let latent = LatentFunctions::new(self.posterior, x)?;
        let rows = self.posterior.covariance().task().rows();
        let density = |row| latent.density_with_noise(row, self.noise_std);
        rows.iter().map(density).collect()
    }
}
