//! What a joint's torques are under each context, as a model predicts them.

use faer::MatRef;
use gp_core::Posterior;
use kernels::Covariance;

use crate::error::MtgpError;
use crate::latent::{LatentFunctions, PredictiveDensity};
use crate::prior::MultiTaskCovariance;

/// One joint's torque under each of m contexts, as a model that has learned them predicts it.
pub trait ContextModel {
    /// Number of contexts m.
    fn n_contexts(&self) -> usize;

    /// The density of the torques at the rows of `x`, all of the same context, for each context.
    ///
    /// # Errors
    /// What keeps the model from predicting there.
    fn predictive_densities(&self, x: MatRef<'_, f64>)
    -> Result<Vec<PredictiveDensity>, MtgpError>;
}

/// The contexts are the tasks; the latent functions are conditioned once for all of them.
impl ContextModel for Posterior<MultiTaskCovariance> {
    fn n_contexts(&self) -> usize {
        self.covariance().n_tasks()
    }

    fn predictive_densities(
        &self,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<PredictiveDensity>, MtgpError> {
        let latent = LatentFunctions::new(self, x)?;
        let rows = self.covariance().task().rows();
        rows.iter().map(|row| latent.density(row)).collect()
    }
}

/// A model of its own for every context.
impl<C: Covariance> ContextModel for Vec<Posterior<C>> {
    fn n_contexts(&self) -> usize {
        self.len()
    }

    fn predictive_densities(
        &self,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<PredictiveDensity>, MtgpError> {
        let of = |posterior| PredictiveDensity::of_posterior(posterior, x);
        self.iter().map(of).collect()
    }
}
