//! The composite controller: feed-forward torques and a correction in proportion to the error.

use crate::dynamics::check::check_len;
use crate::error::DynError;
use crate::motion::reference_motion::JointState;

/// Gains of the correction, in torque units.
///
/// ```text
/// τ = τ_ff + K_p e + K_d ė          e = q_desired − q,  K_p and K_d diagonal
/// ```
/// # Source
/// Sec. 1: the better τ_ff, the lower the gains can be.
#[derive(Debug, Clone, PartialEq)]
pub struct CompositeController {
    stiffness: Vec<f64>,
    damping: Vec<f64>,
}

impl CompositeController {
    /// A controller with its gains.
    ///
    /// # Shapes
    /// `stiffness` K_p (n_joints,), N·m/rad; `damping` K_d (n_joints,), N·m·s/rad; N/m and N·s/m for
    /// sliding joints.
    /// # Errors
    /// [`DynError::OutOfRange`] for a gain below zero or not finite, with the number of its joint.
    /// # Panics
    /// If there are not as many of one as of the other.
    pub fn new(stiffness: Vec<f64>, damping: Vec<f64>) -> Result<Self, DynError> {
        check_len("damping", &damping, stiffness.len());
        for (quantity, gains) in [("stiffness", &stiffness), ("damping", &damping)] {
            let is_bad = |gain: &f64| !gain.is_finite() || *gain < 0.0;
            if let Some(joint) = gains.iter().position(is_bad) {
                return Err(DynError::OutOfRange {
                    what: "gain of joint",
                    name: (joint + 1).to_string(),
                    quantity,
                    value: gains[joint],
                    requirement: "finite and not negative",
                });
            }
        }
        Ok(Self { stiffness, damping })
    }

    /// Gains that give every joint, taken alone with the inertia `inertias`, one bandwidth.
    ///
    /// ```text
    /// K_p = I ω²,   K_d = 2 ζ I ω
    /// ```
    /// # Shapes
    /// `inertias` (n_joints,), kg m² or kg; `bandwidth` ω, rad/s; `damping_ratio` ζ.
    /// # Errors
    /// As for [`CompositeController::new`].
    pub fn with_bandwidth(
        inertias: &[f64],
        bandwidth: f64,
        damping_ratio: f64,
    ) -> Result<Self, DynError> {
        let of_joints = |gain: f64| inertias.iter().map(|inertia| inertia * gain).collect();
        Self::new(
            of_joints(bandwidth * bandwidth),
            of_joints(2.0 * damping_ratio * bandwidth),
        )
    }

    /// Number of joints.
    pub fn n_joints(&self) -> usize {
        self.stiffness.len()
    }

    /// K_p, (n_joints,), N·m/rad or N/m.
    pub fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// K_d, (n_joints,), N·m·s/rad or N·s/m.
    pub fn damping(&self) -> &[f64] {
        &self.damping
    }

    /// Writes τ for a desired and a measured state; allocates nothing.
    ///
    /// # Shapes
    /// `q`, `qd`, `feed_forward` and `tau` (n_joints,).
    /// # Panics
    /// If a slice has another length.
    pub fn torques(
        &self,
        desired: &JointState,
        (q, qd): (&[f64], &[f64]),
        feed_forward: &[f64],
        tau: &mut [f64],
    ) {
        let n = self.n_joints();
        check_len("q", q, n);
        check_len("qd", qd, n);
        check_len("feed_forward", feed_forward, n);
        check_len("tau", tau, n);
        for joint in 0..n {
            let error = desired.q[joint] - q[joint];
            let rate = desired.qd[joint] - qd[joint];
            let correction = self.stiffness[joint] * error + self.damping[joint] * rate;
            tau[joint] = feed_forward[joint] + correction;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn torque_worked_by_hand() {
        let controller = CompositeController::new(vec![10.0], vec![2.0]).unwrap();
        let desired = JointState {
            q: vec![1.0],
            qd: vec![0.5],
            qdd: vec![9.0],
        };
        let mut tau = [0.0];
        controller.torques(&desired, (&[0.75], &[1.0]), &[3.0], &mut tau);
        assert!((tau[0] - (3.0 + 10.0 * 0.25 - 2.0 * 0.5)).abs() <= f64::EPSILON);
    }

    #[test]
    fn gains_that_push_away_are_refused_with_their_joint() {
        let refused = CompositeController::new(vec![1.0, -1.0], vec![0.0; 2]).unwrap_err();
        let message = refused.to_string();
        assert!(message.contains("`2`: stiffness is -1"), "{message}");
        assert!(CompositeController::new(vec![1.0], vec![f64::NAN]).is_err());
    }
}
