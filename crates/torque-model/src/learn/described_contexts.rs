//! mGP(s): processes of several contexts that are related by what is carried in them.

use mtgp::fit::{MultiTaskOptions, fit_described};

use crate::error::{TorqueError, consistent};
use crate::joint_model::JointModel;
use crate::learn::candidate::Candidate;
use crate::learn::learner::Learn;
use crate::learn::many_contexts::{conditioned, of_samples, stacked};
use crate::load_description::{LoadDescription, descriptors};
use crate::samples::{JointTorques, Samples};

/// Processes of contexts whose loads are described.
#[derive(Debug, Clone, PartialEq)]
pub struct DescribedContexts {
    /// What is carried in each context, in the order of the samples' contexts.
    pub loads: Vec<LoadDescription>,
    /// How the hyperparameters are searched for; which joints are continuous, the samples say.
    pub options: MultiTaskOptions,
}

impl Learn for DescribedContexts {
    fn name(&self) -> String {
        "mGP(s)".to_owned()
    }

    fn is_of_many_contexts(&self) -> bool {
        true
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        let (n_loads, n_contexts) = (self.loads.len(), samples.contexts.len());
        consistent(
            (n_loads != n_contexts).then(|| format!("{n_loads} loads of {n_contexts} contexts")),
        )?;
        let options = of_samples(&self.options, samples);
        let data = stacked(samples)?;
        let targets = data.stack(&joint.values);
        let descriptors = descriptors(&self.loads)?;
        tell("K of the loads' mass and first moments");
        let fit = fit_described(&data, &targets, &descriptors, &options)?;
        Ok(vec![fit.into()])
    }

    fn finish(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        candidate: Candidate,
    ) -> Result<JointModel, TorqueError> {
        conditioned(samples, joint, candidate, self.options.likelihood)
    }
}
