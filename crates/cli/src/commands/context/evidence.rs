//! What torques say of a model's contexts.

use mtgp::context::{ContextEvidence, JointTorques, WithTorqueNoise, context_evidence};
use torque_model::{RobotModel, Samples, TorqueError};

/// Eq. (21) without its prior for all samples together, with noise beyond that of the training data, N·m.
///
/// # Errors
/// As for [`context_evidence`].
pub fn evidence_of(
    model: &RobotModel,
    samples: &Samples,
    noise_std: f64,
) -> Result<ContextEvidence, TorqueError> {
    let models: Vec<WithTorqueNoise<'_>> = (model.tasks())
        .map(|(_, process)| WithTorqueNoise {
            posterior: &process.posterior,
            noise_std,
        })
        .collect();
    let joints: Vec<JointTorques<'_>> = (models.iter().zip(&samples.torques))
        .map(|(model, torques)| JointTorques {
            model,
            torques: &torques.values,
        })
        .collect();
    Ok(context_evidence(&joints, samples.x.as_ref())?)
}
