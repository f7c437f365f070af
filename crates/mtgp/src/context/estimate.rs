//! Which context is it: the posterior probabilities of eq. (21).

use faer::MatRef;
use gp_core::GpError;

use crate::context::model::ContextModel;
use crate::error::{MtgpError, require_count};

/// New torques of one joint, and the model of that joint.
#[derive(Clone, Copy)]
pub struct JointTorques<'a> {
    /// The joint's torque under each context.
    pub model: &'a dyn ContextModel,
    /// t*, (k,), N·m.
    pub torques: &'a [f64],
}

/// What new torques say about the context, whatever was believed before.
///
/// # Shapes
/// m contexts.
#[derive(Debug, Clone, PartialEq)]
pub struct ContextEvidence {
    log_densities: Vec<f64>,
    squares: Vec<f64>,
    n_torques: usize,
    /// Torques that tell as much as one.
    correlation: f64,
}

/// The joint predictive density of new torques under each context.
///
/// ```text
/// log p(D* | D, c_γ) = Σ_i log p(t*_i | X*, D, c_γ) = Σ_i log N(t*_i; mean_iγ, Σ_iγ + σ_i² I)
/// ```
/// with the full covariance over the new points, as they are all of one context, and
/// joints i independent given their hyperparameters.
/// A joint whose torques are missing is left out of `joints`, and of the sum.
/// # Shapes
/// `x` (k, 3ℓ), the states that all joints share; k torques of each joint.
/// # Errors
/// [`MtgpError::NoJoints`]; [`MtgpError::CountMismatch`] if joints differ in their number of
/// contexts, or one does not have k torques; [`GpError::NonFiniteTarget`],
/// [`GpError::NonFiniteInput`], [`GpError::WrongCovariates`];
/// [`GpError::NonFiniteLikelihood`] if a density overflows.
/// # Source
/// Eq. (21), without the prior.
pub fn context_evidence(
    joints: &[JointTorques<'_>],
    x: MatRef<'_, f64>,
) -> Result<ContextEvidence, MtgpError> {
    let n_contexts = joints
        .first()
        .ok_or(MtgpError::NoJoints)?
        .model
        .n_contexts();
    let mut evidence = ContextEvidence {
        log_densities: vec![0.0; n_contexts],
        squares: vec![0.0; n_contexts],
        n_torques: 0,
        correlation: 1.0,
    };
    for joint in joints {
        evidence.add(joint, x)?;
    }
    if evidence.log_densities.iter().all(|value| value.is_finite()) {
        return Ok(evidence);
    }
    let n_samples = evidence.n_torques;
    Err(GpError::NonFiniteLikelihood { n_samples })?
}

impl ContextEvidence {
    fn add(&mut self, joint: &JointTorques<'_>, x: MatRef<'_, f64>) -> Result<(), MtgpError> {
        require_count(
            "contexts of a joint",
            joint.model.n_contexts(),
            self.log_densities.len(),
        )?;
        let densities = joint.model.predictive_densities(x)?;
        for (context, density) in densities.iter().enumerate() {
            let (value, squares) = density.log_density(joint.torques)?;
            self.log_densities[context] += value;
            self.squares[context] += squares;
        }
        self.n_torques += joint.torques.len();
        Ok(())
    }

    /// The same evidence of torques whose noise is correlated, c of which tell as much as one.
    ///
    /// ```text
    /// log p/c,   and |z|² of k torques is k/ν χ²_ν with ν = k/c, rounded and at least 1
    /// ```
    /// The densities take noise for independent; in an unbroken log the same error is counted c times.
    /// # Panics
    /// If c is not at least 1.
    /// # Source
    /// Bayley & Hammersley 1946 for k/c; Satterthwaite 1946 for the squares.
    #[must_use]
    pub fn of_correlated(mut self, correlation: f64) -> Self {
        assert!(correlation >= 1.0, "{correlation} torques for one");
        let values = self.log_densities.iter_mut();
        values.for_each(|value| *value /= correlation);
        self.correlation *= correlation;
        self
    }

    /// Number of independent torques that say as much, at least 1 unless there is none.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 1 to the number of torques"
    )]
    pub(crate) fn n_independent(&self) -> usize {
        let n = (self.n_torques as f64 / self.correlation).round() as usize;
        n.max(1).min(self.n_torques)
    }

    /// log p(D* | D, c_γ), (m,), natural logarithm, over all joints.
    pub fn log_densities(&self) -> &[f64] {
        &self.log_densities
    }

    /// Σ_i |z_iγ|², (m,), the squared whitened residuals of all joints.
    ///
    /// Under the right context their sum is χ² with [`ContextEvidence::n_torques`] degrees of freedom.
    pub fn squares(&self) -> &[f64] {
        &self.squares
    }

    /// Number of new torques, over all joints.
    pub fn n_torques(&self) -> usize {
        self.n_torques
    }

    /// The posterior under a prior.
    ///
    /// # Errors
    /// As for [`ContextPosterior::new`].
    pub fn posterior(&self, prior: &ContextPrior) -> Result<ContextPosterior, MtgpError> {
        ContextPosterior::new(&self.log_densities, prior)
    }
}

/// What is believed of the context before the new torques: P(c_γ).
#[derive(Debug, Clone, PartialEq)]
pub struct ContextPrior {
    log_probabilities: Vec<f64>,
}

impl ContextPrior {
    /// Every context is as probable as any other.
    ///
    /// # Errors
    /// [`MtgpError::NoTasks`].
    pub fn uniform(n_contexts: usize) -> Result<Self, MtgpError> {
        if n_contexts == 0 {
            return Err(MtgpError::NoTasks);
        }
        let log_probabilities = vec![-(n_contexts as f64).ln(); n_contexts];
        Ok(Self { log_probabilities })
    }

    /// A prior in proportion to weights, which need not sum to one; zero rules a context out.
    ///
    /// # Errors
    /// [`MtgpError::NoTasks`]; [`MtgpError::NotProbabilities`] if a weight is negative or not
    /// finite, or all are zero.
    pub fn from_weights(weights: &[f64]) -> Result<Self, MtgpError> {
        if weights.is_empty() {
            return Err(MtgpError::NoTasks);
        }
        let sum: f64 = weights.iter().sum();
        let are_usable = weights.iter().all(|weight| *weight >= 0.0);
        if !are_usable || !sum.is_finite() || sum <= 0.0 {
            let (what, row) = ("prior", 0);
            return Err(MtgpError::NotProbabilities { what, row, sum });
        }
        let log_probabilities = weights.iter().map(|weight| (weight / sum).ln()).collect();
        Ok(Self { log_probabilities })
    }

    /// log P(c_γ), (m,).
    pub fn log_probabilities(&self) -> &[f64] {
        &self.log_probabilities
    }
}

/// What is believed of the context after the new torques.
///
/// ```text
/// log P(c_γ | D, D*) = log P(c_γ) + log p(D* | D, c_γ) − log Σ_δ P(c_δ) p(D* | D, c_δ)
/// ```
/// The sum is taken around its largest term, so that differences of any size, a thousand nats
/// or more, leave probabilities that sum to one.
/// # Source
/// Eq. (21).
#[derive(Debug, Clone, PartialEq)]
pub struct ContextPosterior {
    log_probabilities: Vec<f64>,
}

impl ContextPosterior {
    /// The posterior for log densities of any origin.
    ///
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless there is one density per context of the prior;
    /// [`MtgpError::NoUsableDensity`] if one is NaN or +∞, or every context that the prior
    /// allows has density zero.
    pub fn new(log_densities: &[f64], prior: &ContextPrior) -> Result<Self, MtgpError> {
        let n_contexts = prior.log_probabilities.len();
        require_count("densities of contexts", log_densities.len(), n_contexts)?;
        let mut log_probabilities: Vec<f64> = (log_densities.iter())
            .zip(&prior.log_probabilities)
            .map(|(density, prior)| density + prior)
            .collect();
        normalise(&mut log_probabilities)?;
        Ok(Self { log_probabilities })
    }

    /// log P(c_γ | D, D*), (m,), natural logarithm.
    pub fn log_probabilities(&self) -> &[f64] {
        &self.log_probabilities
    }

    /// P(c_γ | D, D*), (m,), which sum to one.
    pub fn probabilities(&self) -> Vec<f64> {
        self.log_probabilities.iter().map(|log| log.exp()).collect()
    }

    /// The context of the largest probability, the first of several.
    pub fn most_probable(&self) -> usize {
        most_probable(&self.log_probabilities)
    }
}

/// The place of the largest value, the first of several.
pub(crate) fn most_probable(log_probabilities: &[f64]) -> usize {
    let mut best = 0;
    for (context, log) in log_probabilities.iter().enumerate() {
        if *log > log_probabilities[best] {
            best = context;
        }
    }
    best
}

/// Subtracts log Σ_γ exp(value_γ) from every value.
///
/// # Errors
/// [`MtgpError::NoUsableDensity`] if a value is NaN or +∞, or all are −∞.
pub(crate) fn normalise(values: &mut [f64]) -> Result<(), MtgpError> {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let has_nan = values.iter().any(|value| value.is_nan());
    if has_nan || !largest.is_finite() {
        return Err(MtgpError::NoUsableDensity);
    }
    let sum: f64 = values.iter().map(|value| (value - largest).exp()).sum();
    for value in values {
        // In this order, as the sum of both would round what the difference does not.
        *value = (*value - largest) - sum.ln();
    }
    Ok(())
}
