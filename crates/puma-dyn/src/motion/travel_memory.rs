//! Hysteresis states of an arm in motion, by how far its joints have travelled since they last turned back.
//!
//! ```text
//! z(q) = s + (z₀ − s) exp(−|q − q₀|/δ)          s direction, (q₀, z₀) where the present piece of the motion began
//! ```
//! While a joint does not turn back, its state is this function of its position, so that there is nothing to
//! integrate and nothing stiff, however short δ is.

use crate::motion::stick_slip::SlipMode;
use crate::robot::friction_term::next_hysteresis;
use crate::robot::smooth_friction::Spring;

/// Hysteresis states, where they were at the beginning of a piece of motion and where they are now.
#[derive(Debug, Clone)]
pub(crate) struct TravelMemory {
    springs: Vec<Spring>,
    first_q: Vec<f64>,
    first_z: Vec<f64>,
    z: Vec<f64>,
}

impl TravelMemory {
    /// Of an arm that begins at `q`, without a past.
    pub(crate) fn new(springs: &[Spring], q: &[f64]) -> Self {
        let zeros = vec![0.0; springs.len()];
        Self {
            first_q: springs.iter().map(|spring| q[spring.joint_idx]).collect(),
            springs: springs.to_vec(),
            first_z: zeros.clone(),
            z: zeros,
        }
    }

    /// The states that were last worked out.
    pub(crate) fn states(&self) -> &[f64] {
        &self.z
    }

    /// Goes back to the beginning of the piece.
    pub(crate) fn rewind(&mut self) {
        self.z.copy_from_slice(&self.first_z);
    }

    /// Works the states out at positions that the modes lead to.
    pub(crate) fn follow(&mut self, q: &[f64], modes: &[SlipMode]) {
        for (idx, spring) in self.springs.iter().enumerate() {
            let moved = q[spring.joint_idx] - self.first_q[idx];
            // A trial step may end behind its beginning, where the piece never goes.
            let travel = match modes[spring.joint_idx] {
                SlipMode::Positive => moved.max(0.0),
                SlipMode::Negative => moved.min(0.0),
                SlipMode::Frictionless | SlipMode::Sticking => 0.0,
            };
            self.z[idx] = next_hysteresis(self.first_z[idx], travel, 1.0, spring.length);
        }
    }

    /// Begins a piece at positions that the modes have led to.
    pub(crate) fn begin(&mut self, q: &[f64], modes: &[SlipMode]) {
        self.follow(q, modes);
        self.first_z.copy_from_slice(&self.z);
        for (first, spring) in self.first_q.iter_mut().zip(&self.springs) {
            *first = q[spring.joint_idx];
        }
    }
}
