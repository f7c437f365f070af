//! The memory of friction: hysteresis states of all joints, and what stands in for them without a past.

use crate::dynamics::check::check_len;
use crate::robot::friction_term::next_hysteresis;
use crate::robot::model::Model;
use crate::robot::smooth_friction::Spring;

/// Hysteresis states z of a model's joints; none for a model whose friction has no memory.
///
/// ```
/// use puma_dyn::dynamics::Hysteresis;
/// use puma_dyn::puma560;
///
/// let hysteresis = Hysteresis::new(&puma560::model());
/// assert!(hysteresis.is_empty());
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Hysteresis {
    springs: Vec<Spring>,
    z: Vec<f64>,
}

impl Hysteresis {
    /// The states of a model at the beginning of a motion: zero.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        Self::of_springs(model.springs().to_vec())
    }

    /// The same of every joint for each length: those of all joints for the first, then for the next.
    ///
    /// # Shapes
    /// `lengths`, rad or m.
    #[must_use]
    pub fn of_every_joint(n_joints: usize, lengths: &[f64]) -> Self {
        let of_length = |&length| (0..n_joints).map(move |joint_idx| Spring { joint_idx, length });
        Self::of_springs(lengths.iter().flat_map(of_length).collect())
    }

    fn of_springs(springs: Vec<Spring>) -> Self {
        Self {
            z: vec![0.0; springs.len()],
            springs,
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.z.is_empty()
    }

    /// The states, joint after joint, within −1 and 1.
    pub fn states(&self) -> &[f64] {
        &self.z
    }

    /// Forgets the past: all states are zero.
    pub fn reset(&mut self) {
        self.z.fill(0.0);
    }

    /// Every joint moves at q̇ for `step` seconds; see [`next_hysteresis`].
    ///
    /// Allocates nothing.
    /// # Shapes
    /// `qd` (n_joints,), rad/s or m/s.
    /// # Panics
    /// If there is no such joint.
    pub fn advance(&mut self, qd: &[f64], step: f64) {
        for (z, spring) in self.z.iter_mut().zip(&self.springs) {
            *z = next_hysteresis(*z, qd[spring.joint_idx], step, spring.length);
        }
    }

    /// Every joint travels straight from one position to another.
    ///
    /// What is forgotten depends on the travel alone; the time that it takes does not matter.
    /// # Shapes
    /// `from`, `to` (n_joints,), rad or m.
    /// # Panics
    /// If there is no such joint.
    pub fn travel(&mut self, from: &[f64], to: &[f64]) {
        for (z, spring) in self.z.iter_mut().zip(&self.springs) {
            let travel = to[spring.joint_idx] - from[spring.joint_idx];
            *z = next_hysteresis(*z, travel, 1.0, spring.length);
        }
    }

    /// # Panics
    /// If it belongs to another model.
    #[inline]
    pub(crate) fn check(&self, model: &Model) {
        check_len("hysteresis", &self.z, model.springs().len());
    }
}

/// Where hysteresis states come from.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Memory<'a> {
    /// The joints have moved as they do for long: z = sgn q̇, zero at rest.
    Lasting,
    /// States, one for each spring of the model.
    States(&'a [f64]),
}

impl Memory<'_> {
    /// The state of a spring whose joint moves at `qd`.
    #[inline]
    pub(crate) fn z(self, spring_idx: usize, qd: f64) -> f64 {
        match self {
            Self::Lasting if qd > 0.0 => 1.0,
            Self::Lasting if qd < 0.0 => -1.0,
            Self::Lasting => 0.0,
            Self::States(z) => z[spring_idx],
        }
    }
}
