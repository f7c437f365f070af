//! One joint of a robot whose parameters are learned for all joints together.

use std::sync::Arc;

use faer::{Mat, MatRef};
use gp_core::Prediction;

use crate::error::TorqueError;
use crate::process::TorqueFunction;
use crate::rigid_body::noise::JointNoise;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::term_set::TermSet;

/// A joint's torque by parameters that all joints and loads share.
#[derive(Debug, Clone)]
pub struct SharedJoint {
    posterior: Arc<ParameterPosterior>,
    joint_idx: usize,
    terms: TermSet,
    noise: JointNoise,
}

impl SharedJoint {
    /// A joint of a posterior; `None` for one without torques.
    pub fn new(posterior: &Arc<ParameterPosterior>, joint_idx: usize) -> Option<Self> {
        let learned = posterior.parts().joints.get(joint_idx)?.as_ref()?;
        Some(Self {
            posterior: Arc::clone(posterior),
            joint_idx,
            terms: learned.terms,
            noise: learned.noise,
        })
    }

    /// The posterior of the parameters.
    pub fn posterior(&self) -> &Arc<ParameterPosterior> {
        &self.posterior
    }

    /// The joint, from 0.
    pub fn joint_idx(&self) -> usize {
        self.joint_idx
    }

    /// The friction terms that it keeps.
    pub fn terms(&self) -> TermSet {
        self.terms
    }

    /// Means at states in every context, N·m: those of [`TorqueFunction::predict_mean`] to the bit.
    ///
    /// # Shapes
    /// `x` (n, 3ℓ) as there; (n, contexts).
    /// # Errors
    /// As there.
    pub fn predict_mean_of_all_contexts(
        &self,
        x: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, TorqueError> {
        (self.posterior).predict_mean_in_all_contexts(self.joint_idx, x)
    }

    /// Its noise.
    pub fn noise(&self) -> &JointNoise {
        &self.noise
    }
}

impl TorqueFunction for SharedJoint {
    fn n_joints(&self) -> usize {
        self.posterior.unknowns().n_joints()
    }

    fn n_contexts(&self) -> usize {
        self.posterior.n_contexts()
    }

    fn noise_var(&self) -> f64 {
        self.noise.std.powi(2)
    }

    fn predict(&self, context: usize, x: MatRef<'_, f64>) -> Result<Prediction, TorqueError> {
        let (mean, var) = (self.posterior).predict_joint(self.joint_idx, context, x)?;
        Ok(Prediction {
            mean,
            var,
            n_clamped: 0,
        })
    }

    fn predict_mean(&self, context: usize, x: MatRef<'_, f64>) -> Result<Vec<f64>, TorqueError> {
        Ok(self.predict(context, x)?.mean)
    }
}
