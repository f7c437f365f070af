//! The trained model in the form that a control loop asks, one state at a time.

use crate::error::GpError;
use crate::model::torque_model::TorqueModel;

/// Predicts all learned joints at one state.
#[derive(Debug, Clone)]
pub struct Predictor {}

/// Scratch of a [`Predictor`], one per thread.
#[derive(Debug, Clone)]
pub struct PredictorScratch {}

impl Predictor {
    pub(crate) fn new(_model: &TorqueModel) -> Self {
        Self {}
    }

    /// Scratch for [`Predictor::predict_into`].
    pub fn scratch(&self) -> PredictorScratch {
        PredictorScratch {}
    }

    /// Means and latent variances.
    ///
    /// # Errors
    /// [`GpError::NonFiniteInput`]
    pub fn predict_into(
        &self,
        _scratch: &mut PredictorScratch,
        _x: &[f64],
        mean: &mut [f64],
        var: &mut [f64],
    ) -> Result<(), GpError> {
        mean.fill(f64::NAN);
        var.fill(f64::NAN);
        Ok(())
    }
}
