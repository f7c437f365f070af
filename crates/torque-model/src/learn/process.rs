//! GP¬c and GPc: a Gaussian process of one load, eqs. (3)–(8) and (22).

use gp_core::FitOptions;
use kernels::TorqueForm;

use crate::error::TorqueError;
use crate::joint_model::{JointModel, process_name};
use crate::learn::candidate::Candidate;
use crate::learn::learner::Learn;
use crate::samples::{JointTorques, Samples};

/// A process with the covariance of eq. (7).
#[derive(Debug, Clone, PartialEq)]
pub struct SingleProcess {
    /// Whether friction is among its terms.
    pub form: TorqueForm,
    /// How its hyperparameters are searched for; which joints are continuous, the samples say.
    pub options: FitOptions,
}

impl Learn for SingleProcess {
    fn name(&self) -> String {
        process_name(self.form).to_owned()
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        tell(&self.name());
        let x = samples.x.as_ref();
        let options = FitOptions {
            continuous: samples.continuous.clone(),
            ..self.options.clone()
        };
        let fit = gp_core::fit(x, &joint.values, self.form, &options)?;
        Ok(vec![JointModel::from(fit).into()])
    }
}
