//! The context on-line: one state and its torques at a time, with bounded work and no allocation.

use gp_core::{GpError, Posterior};

use crate::context::estimate::ContextPrior;
use crate::context::filter::{ContextFilter, ContextTransition};
use crate::context::outliers::Outliers;
use crate::context::window::SampleWindow;
use crate::error::{MtgpError, require_count};
use crate::prior::MultiTaskCovariance;

/// Follows the context of a robot in motion.
///
/// ```text
/// p_s(γ) = Π_i p(t_is | x_s, D, the last w torques of joint i, c_γ)
/// ```
/// and [`ContextFilter`] over them.
///
/// With w = 0 samples are taken as independent given the context, which they are not: what the
/// model does not know at x_s it does not know at the neighbours either, so that a long look at
/// one place counts as many looks. A window of w > 0 takes their covariance into account.
/// With T = I and w at least the number of samples, the result is eq. (21) exactly.
/// After a change of context, the w samples before it count as samples of the new context:
/// w should be short beside the delay that is allowed.
///
/// A step takes O(b²r + w r² b + m w² + m w r²) per joint for b basis points, all of it in memory
/// that was set aside at the start; what depends on the posterior alone, O(b³), is done once, and
/// shared by copies.
/// The dense path has b = n; 1 kHz asks for few samples, or `torque_model::RobotModel::for_tracking`.
/// # Source
/// Eq. (21) with the Markov prior of section 5.
#[derive(Debug, Clone)]
pub struct ContextTracker {
    joints: Vec<SampleWindow>,
    filter: ContextFilter,
    log_densities: Vec<f64>,
    /// Samples that tell as much as one.
    correlation: f64,
}

impl ContextTracker {
    /// A tracker before its first sample.
    ///
    /// # Shapes
    /// One posterior per joint; `window` w, in samples.
    /// # Errors
    /// [`MtgpError::NoJoints`]; [`MtgpError::CountMismatch`] if joints, prior and chain differ in
    /// their number of contexts, or joints in their covariates; [`GpError::NotPositiveDefinite`]
    /// if a posterior's factor is not finite.
    pub fn new<'a>(
        joints: impl IntoIterator<Item = &'a Posterior<MultiTaskCovariance>>,
        window: usize,
        prior: &ContextPrior,
        transition: ContextTransition,
    ) -> Result<Self, MtgpError> {
        let joints: Vec<SampleWindow> = (joints.into_iter())
            .map(|posterior| SampleWindow::new(posterior, window))
            .collect::<Result<_, _>>()?;
        let n_covariates = joints.first().ok_or(MtgpError::NoJoints)?.n_covariates();
        let filter = ContextFilter::new(prior, transition)?;
        let n_contexts = filter.log_probabilities().len();
        for joint in &joints {
            require_count("contexts of a joint", joint.n_contexts(), n_contexts)?;
            require_count("covariates of a joint", joint.n_covariates(), n_covariates)?;
        }
        Ok(Self {
            joints,
            filter,
            log_densities: vec![0.0; n_contexts],
            correlation: 1.0,
        })
    }

    /// The tracker for torques with noise beyond the σ of each joint's model.
    ///
    /// # Shapes
    /// `noise_std` (ℓ,), N·m.
    /// # Errors
    /// [`MtgpError::CountMismatch`]; [`GpError::BadNoise`] for one that is negative or not finite.
    pub fn with_torque_noise(mut self, noise_std: &[f64]) -> Result<Self, MtgpError> {
        require_count("noises of joints", noise_std.len(), self.joints.len())?;
        for (joint, &noise_std) in self.joints.iter_mut().zip(noise_std) {
            if !(noise_std >= 0.0 && noise_std.is_finite()) {
                return Err(GpError::BadNoise { value: noise_std }.into());
            }
            joint.add_noise(noise_std);
        }
        Ok(self)
    }

    /// The tracker for samples whose noise is correlated, c of which tell as much as one: log p_s(γ) counts 1/c.
    ///
    /// # Panics
    /// If c is not at least 1.
    #[must_use]
    pub fn of_correlated(mut self, correlation: f64) -> Self {
        assert!(correlation >= 1.0, "{correlation} samples for one");
        self.correlation *= correlation;
        self
    }

    /// The tracker for torques of which some are off by more than the model allows for.
    ///
    /// A state far from those learned, such as the millisecond in which feed-forward of friction
    /// turns before the joint does, can be implausible under every context; without outliers, the
    /// least implausible one wins however long another was right.
    /// With a window, a torque that was off stays in it.
    #[must_use]
    pub fn with_outliers(mut self, outliers: Outliers) -> Self {
        for joint in &mut self.joints {
            joint.expect_outliers(outliers);
        }
        self
    }

    /// Takes a sample in, and returns log P_s, (m,).
    ///
    /// A joint without a torque at this sample says nothing of the context.
    /// # Shapes
    /// `x` (3ℓ,); `torques` (ℓ,), N·m.
    /// # Errors
    /// [`MtgpError::CountMismatch`], [`GpError::WrongCovariates`]; [`GpError::NonFiniteInput`],
    /// with the covariate as the column; [`GpError::NonFiniteTarget`], with the joint as the row;
    /// [`MtgpError::NoUsableDensity`] if a density overflows.
    /// The tracker is then as before the call.
    pub fn step(&mut self, x: &[f64], torques: &[Option<f64>]) -> Result<&[f64], MtgpError> {
        self.require(x, torques)?;
        self.log_densities.fill(0.0);
        for (joint, torque) in self.joints.iter_mut().zip(torques) {
            if let Some(torque) = torque {
                joint.push(x, *torque, &mut self.log_densities);
            }
        }
        let densities = self.log_densities.iter_mut();
        densities.for_each(|density| *density /= self.correlation);
        if self.filter.step(&self.log_densities).is_err() {
            for (joint, torque) in self.joints.iter_mut().zip(torques) {
                if torque.is_some() {
                    joint.undo_push();
                }
            }
            return Err(MtgpError::NoUsableDensity);
        }
        Ok(self.filter.log_probabilities())
    }

    fn require(&self, x: &[f64], torques: &[Option<f64>]) -> Result<(), MtgpError> {
        let (found, expected) = (x.len(), self.joints[0].n_covariates());
        if found != expected {
            return Err(GpError::WrongCovariates { found, expected }.into());
        }
        require_count("torques of joints", torques.len(), self.joints.len())?;
        if let Some(column) = x.iter().position(|value| !value.is_finite()) {
            let (row, value) = (0, x[column]);
            return Err(GpError::NonFiniteInput { row, column, value }.into());
        }
        for (row, torque) in torques.iter().enumerate() {
            if let Some(value) = torque.filter(|torque| !torque.is_finite()) {
                return Err(GpError::NonFiniteTarget { row, value }.into());
            }
        }
        Ok(())
    }

    /// log p_s(γ)/c of the latest sample, (m,), natural logarithm, over all joints; c is 1 unless
    /// [`ContextTracker::of_correlated`] says otherwise.
    pub fn log_densities(&self) -> &[f64] {
        &self.log_densities
    }

    /// What is believed of the context at the latest sample.
    pub fn filter(&self) -> &ContextFilter {
        &self.filter
    }
}
