//! Terms that a joint's friction torque is linear in: speed, direction, memory and load.
//!
//! ```text
//! τ_f = Σ_k θ_k φ_k(q̇, q̈, z, τ^rb)
//! φ: q̈, q̇, 1, tanh(q̇/v), [q̇ > 0], [q̇ < 0], z^δ, |τ^rb| z^δ, |τ^rb| q̇
//! ```
//! z^δ is the state of pre-sliding friction, a spring that gives way within a length δ of travel;
//! τ^rb is the joint's rigid-body torque, whose size presses the teeth of its gear.
//!
//! # Source
//! Dahl 1968, *A Solid Friction Model*, for z; Armstrong-Hélouvry, Dupont & Canudas de Wit 1994, "A survey of
//! models, analysis tools and compensation methods for the control of machines with friction", for the rest.

/// One term φ_k of a joint's friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionTerm {
    /// q̈: the rotor's inertia, kg m².
    Acceleration,
    /// q̇: viscous, N·m·s/rad.
    Speed,
    /// 1: an offset of the measurement, N·m.
    Offset,
    /// tanh(q̇/v), v in rad/s: Coulomb friction with a smooth change of direction, N·m.
    Tanh {
        /// v, rad/s.
        width: f64,
    },
    /// [q̇ > 0]: Coulomb friction of positive speed, N·m.
    StepUp,
    /// [q̇ < 0]: Coulomb torque of negative speed, N·m.
    StepDown,
    /// z^δ: Coulomb friction with memory, N·m.
    Hysteresis {
        /// δ, rad.
        length: f64,
    },
    /// |τ^rb| z^δ: the same as a part of the load.
    LoadHysteresis {
        /// δ, rad.
        length: f64,
    },
    /// |τ^rb| q̇: viscous friction as a part of the load, s/rad.
    LoadSpeed,
}

/// What a joint's friction depends on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveState {
    /// q̇, rad/s.
    pub qd: f64,
    /// q̈, rad/s².
    pub qdd: f64,
    /// z^δ of the term's length; of no account for terms without one.
    pub z: f64,
    /// τ^rb, N·m; of no account for terms that the load does not change.
    pub rigid: f64,
}

impl FrictionTerm {
    /// φ_k at a state.
    #[inline]
    pub fn value(self, at: DriveState) -> f64 {
        match self {
            Self::Acceleration => at.qdd,
            Self::Speed => at.qd,
            Self::Offset => 1.0,
            Self::Tanh { width } => (at.qd / width).tanh(),
            Self::StepUp => f64::from(u8::from(at.qd > 0.0)),
            Self::StepDown => f64::from(u8::from(at.qd < 0.0)),
            Self::Hysteresis { .. } => at.z,
            Self::LoadHysteresis { .. } => at.rigid.abs() * at.z,
            Self::LoadSpeed => at.rigid.abs() * at.qd,
        }
    }

    /// The length δ of its hysteresis state, rad; `None` without one.
    pub fn length(self) -> Option<f64> {
        match self {
            Self::Hysteresis { length } | Self::LoadHysteresis { length } => Some(length),
            _ => None,
        }
    }

    /// Whether it grows with the joint's rigid-body torque.
    pub fn is_of_load(self) -> bool {
        matches!(self, Self::LoadHysteresis { .. } | Self::LoadSpeed)
    }
}

/// The hysteresis state after a step: the joint moved at q̇ for `step` seconds.
///
/// ```text
/// z ← s + (z − s) exp(−|q̇| Δt/δ),   s = sgn q̇,  sgn 0 = 0
/// ```
/// # Source
/// Dahl 1968 with exponent 1, integrated over the step.
#[inline]
#[must_use]
pub fn next_hysteresis(z: f64, qd: f64, step: f64, length: f64) -> f64 {
    let s = if qd > 0.0 {
        1.0
    } else if qd < 0.0 {
        -1.0
    } else {
        0.0
    };
    s + (z - s) * (-qd.abs() * step / length).exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_lost_within_a_few_lengths() {
        // From z = −1, 1 mrad at 0.5 mrad: 1 − 2 e⁻²; at rest nothing moves.
        let z = next_hysteresis(-1.0, 0.1, 0.01, 5e-4);
        assert!((z - (1.0 - 2.0 * (-2.0_f64).exp())).abs() < 1e-15, "{z}");
        assert!((next_hysteresis(z, 0.0, 1.0, 5e-4) - z).abs() < 1e-15);
    }

    #[test]
    fn steps_compose() {
        let half = next_hysteresis(next_hysteresis(0.3, -0.2, 0.004, 2e-3), -0.2, 0.006, 2e-3);
        let whole = next_hysteresis(0.3, -0.2, 0.01, 2e-3);
        assert!((half - whole).abs() < 1e-15);
    }
}
