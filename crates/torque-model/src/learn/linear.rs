//! LR¬c and LRc: Bayesian linear regression, eq. (9).

use gp_core::fit::{BayesLinear, LinearForm};

use crate::error::TorqueError;
use crate::joint_model::{JointModel, linear_name};
use crate::learn::candidate::Candidate;
use crate::learn::learner::Learn;
use crate::samples::{JointTorques, Samples};

/// Torques that are linear in the state, and in the signs of the speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Linear {
    /// Whether the signs are among the features.
    pub form: LinearForm,
}

impl Linear {
    /// LR¬c.
    pub fn smooth() -> Self {
        let form = LinearForm::Smooth;
        Self { form }
    }

    /// LRc.
    pub fn coulomb() -> Self {
        let form = LinearForm::Coulomb;
        Self { form }
    }
}

impl Learn for Linear {
    fn name(&self) -> String {
        linear_name(self.form).to_owned()
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        _tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        let linear = BayesLinear::fit(samples.x.as_ref(), &joint.values, self.form)?;
        Ok(vec![JointModel::from(linear).into()])
    }
}
