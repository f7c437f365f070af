//! What torques say of a model's contexts.

use mtgp::context::{ContextEvidence, JointTorques, WithTorqueNoise, context_evidence};
use torque_model::rigid_body::LEAST_SECONDS;
use torque_model::{RobotModel, Samples, TorqueError};

/// Eq. (21) without its prior for all samples together, with noise beyond that of the training data, N·m.
///
/// Rows that are close in time count as one in [`LEAST_SECONDS`].
/// # Errors
/// As for [`context_evidence`]; time that does not rise within a run.
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
    let correlation = samples.rows_per_independent(LEAST_SECONDS)?;
    let evidence = context_evidence(&joints, samples.x.as_ref())?;
    Ok(evidence.of_correlated(correlation))
}
