//! What a learner has of one joint before a setting is chosen.

use gp_core::search::FitReport;
use mtgp::{MultiTaskCovariance, TaskFit};

use crate::joint_model::JointModel;

/// One joint at one setting.
#[derive(Debug, Clone)]
pub enum Candidate {
    /// A model as it is.
    Model(Box<JointModel>),
    /// Hyperparameters, without what depends on the data.
    Tasks(Box<TaskCandidate>),
}

impl From<JointModel> for Candidate {
    fn from(model: JointModel) -> Self {
        Self::Model(Box::new(model))
    }
}

/// One joint at one rank: its hyperparameters and how they were found.
///
/// Fits of all ranks of all joints would hold as many factors; the one that is kept is conditioned again.
#[derive(Debug, Clone)]
pub struct TaskCandidate {
    pub(super) covariance: MultiTaskCovariance,
    pub(super) noise_std: f64,
    pub(super) report: FitReport,
}

impl From<TaskFit> for Candidate {
    fn from(fit: TaskFit) -> Self {
        Self::Tasks(Box::new(TaskCandidate {
            covariance: fit.covariance().clone(),
            noise_std: fit.noise_std(),
            report: fit.report,
        }))
    }
}
