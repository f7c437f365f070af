//! LR¬c and LRc: Bayesian linear regression, eq. (9).

use gp_core::fit::{BayesLinear, LinearForm};

use crate::error::TorqueError;
use crate::joint_model::{JointModel, linear_name};
use crate::learn::candidate::Candidate;
use crate::learn::learner::Learn;
use crate::samples::{JointTorques, Samples};
use crate::spacing::residual_correlation;

/// Torques that are linear in the state, and in the signs of the speeds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Linear {
    /// Whether the signs are among the features.
    pub form: LinearForm,
    /// Whence the variances of noise and weights are.
    pub variances: LinearVariances,
}

/// The variances of a linear model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinearVariances {
    /// Those of eq. (9), for torques of an arm in N·m and features as they are.
    Chapter,
    /// Those of the highest evidence, for standardised features and independent rows.
    Evident,
    /// The same where what is left of the torques is correlated within runs: [`residual_correlation`] rows count as one.
    EvidentWithinRuns,
}

impl Linear {
    /// LR¬c, with the variances of eq. (9).
    pub fn smooth() -> Self {
        Self::of_chapter(LinearForm::Smooth)
    }

    /// LRc, with the variances of eq. (9).
    pub fn coulomb() -> Self {
        Self::of_chapter(LinearForm::Coulomb)
    }

    fn of_chapter(form: LinearForm) -> Self {
        let variances = LinearVariances::Chapter;
        Self { form, variances }
    }

    /// The same model with the variances of the highest evidence, of rows taken for independent.
    #[must_use]
    pub fn by_evidence(self) -> Self {
        let variances = LinearVariances::Evident;
        Self { variances, ..self }
    }

    /// The same model with the variances of the highest evidence, of rows that are correlated within runs.
    #[must_use]
    pub fn by_evidence_within_runs(self) -> Self {
        let variances = LinearVariances::EvidentWithinRuns;
        Self { variances, ..self }
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
        let (x, torques) = (samples.x.as_ref(), &joint.values);
        let linear = match self.variances {
            LinearVariances::Chapter => BayesLinear::fit(x, torques, self.form)?,
            LinearVariances::Evident => BayesLinear::fit_by_evidence(x, torques, self.form)?,
            LinearVariances::EvidentWithinRuns => within_runs(samples, torques, self.form)?,
        };
        Ok(vec![JointModel::from(linear).into()])
    }
}

/// A first fit says by what it leaves how many rows count as one.
fn within_runs(
    samples: &Samples,
    torques: &[f64],
    form: LinearForm,
) -> Result<BayesLinear, TorqueError> {
    let x = samples.x.as_ref();
    let first = BayesLinear::fit_by_evidence(x, torques, form)?;
    let mean = first.predict_mean(x)?;
    let residuals: Vec<f64> = torques.iter().zip(mean).map(|(t, mean)| t - mean).collect();
    let correlation = residual_correlation(samples, &residuals)?;
    if correlation > 1.0 {
        let fit = BayesLinear::fit_correlated_by_evidence;
        Ok(fit(x, torques, form, correlation)?)
    } else {
        Ok(first)
    }
}
