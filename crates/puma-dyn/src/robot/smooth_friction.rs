//! Friction of a joint beyond viscous and Coulomb: an offset, a smooth change of direction, memory, load.
//!
//! ```text
//! τ_s = o + Σ_k c_k tanh(q̇/v_k) + Σ_k h_k z^δk + |τ^rb| (Σ_k l_k z^δk + b_l q̇)
//! ```
//! Every sum is over a list that may be empty, and every torque acts at the joint, after the gear.

use serde::{Deserialize, Serialize};

use crate::robot::friction_term::{DriveState, FrictionTerm};

/// Offset, smooth Coulomb friction, friction with memory and friction of the load, joint side.
///
/// A coefficient may be negative: friction that falls with speed is a difference of two terms.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SmoothFriction {
    /// o, N·m or N: what the measured torque is off by.
    pub offset: f64,
    /// Coulomb friction with a smooth change of direction.
    pub tanh: Vec<TanhFriction>,
    /// Coulomb friction with memory.
    pub hysteresis: Vec<HysteresisFriction>,
    /// The same as a part of the rigid-body torque.
    pub load_hysteresis: Vec<LoadHysteresisFriction>,
    /// b_l, s/rad or s/m: viscous friction as a part of the rigid-body torque.
    pub load_viscous: f64,
}

/// c tanh(q̇/v).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TanhFriction {
    /// v, rad/s or m/s; above zero.
    pub width: f64,
    /// c, N·m or N.
    pub torque: f64,
}

/// h z^δ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HysteresisFriction {
    /// δ, rad or m; above zero.
    pub length: f64,
    /// h, N·m or N.
    pub torque: f64,
}

/// l |τ^rb| z^δ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoadHysteresisFriction {
    /// δ, rad or m; above zero.
    pub length: f64,
    /// l, a part of the load.
    pub coefficient: f64,
}

impl SmoothFriction {
    /// No such friction.
    pub const NONE: Self = Self {
        offset: 0.0,
        tanh: Vec::new(),
        hysteresis: Vec::new(),
        load_hysteresis: Vec::new(),
        load_viscous: 0.0,
    };

    /// Its terms φ_k with their coefficients θ_k, those that are stated as zero left out.
    pub fn terms(&self) -> impl Iterator<Item = (FrictionTerm, f64)> + '_ {
        let tanh = self.tanh.iter().map(|&TanhFriction { width, torque }| {
            let term = FrictionTerm::Tanh { width };
            (term, torque)
        });
        let hysteresis = self.hysteresis.iter();
        let hysteresis = hysteresis.map(|&HysteresisFriction { length, torque }| {
            let term = FrictionTerm::Hysteresis { length };
            (term, torque)
        });
        let of_load = self.load_hysteresis.iter().map(|of_load| {
            let length = of_load.length;
            (FrictionTerm::LoadHysteresis { length }, of_load.coefficient)
        });
        std::iter::once((FrictionTerm::Offset, self.offset))
            .chain(tanh)
            .chain(hysteresis)
            .chain(of_load)
            .chain([(FrictionTerm::LoadSpeed, self.load_viscous)])
            .filter(|(_, coefficient)| coefficient.abs() > 0.0)
    }
}

/// A hysteresis state of a model: whose it is, and within what travel it forgets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spring {
    pub joint_idx: usize,
    /// δ, rad or m.
    pub length: f64,
}

/// Smooth friction of one joint as the recursions see it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SmoothLaw {
    terms: Vec<LawTerm>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct LawTerm {
    term: FrictionTerm,
    coefficient: f64,
    /// Its state among the model's; of no account for terms without one.
    spring_idx: usize,
}

/// Smooth friction at a speed: `own + |load| share`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SmoothTorque {
    /// N·m or N.
    pub own: f64,
    /// A part of the load.
    pub share: f64,
}

impl SmoothLaw {
    /// The law of a joint; its hysteresis states are appended to `springs`, one for each length.
    pub(crate) fn new(
        joint_idx: usize,
        friction: &SmoothFriction,
        springs: &mut Vec<Spring>,
    ) -> Self {
        let first = springs.len();
        let mut spring_idx = |length: f64| {
            let is_known = |spring: &Spring| spring.length.to_bits() == length.to_bits();
            let known = springs[first..].iter().position(is_known);
            if known.is_none() {
                springs.push(Spring { joint_idx, length });
            }
            known.map_or(springs.len() - 1, |idx| first + idx)
        };
        let terms = friction.terms().map(|(term, coefficient)| LawTerm {
            term,
            coefficient,
            spring_idx: term.length().map_or(0, &mut spring_idx),
        });
        Self {
            terms: terms.collect(),
        }
    }

    pub(crate) fn is_none(&self) -> bool {
        self.terms.is_empty()
    }

    /// Whether it has memory.
    pub(crate) fn has_memory(&self) -> bool {
        self.terms.iter().any(|law| law.term.length().is_some())
    }

    /// What it is at a speed, with `z` the hysteresis state of a number.
    #[inline]
    pub(crate) fn at(&self, qd: f64, z: impl Fn(usize) -> f64) -> SmoothTorque {
        let mut torque = SmoothTorque::NONE;
        for law in &self.terms {
            let has_state = law.term.length().is_some();
            let unit_load = DriveState {
                qd,
                qdd: 0.0,
                z: if has_state { z(law.spring_idx) } else { 0.0 },
                rigid: 1.0,
            };
            let value = law.coefficient * law.term.value(unit_load);
            if law.term.is_of_load() {
                torque.share += value;
            } else {
                torque.own += value;
            }
        }
        torque
    }

    /// Upper bounds of what it changes by with speed and with travel, while its load is at most `load`.
    ///
    /// ```text
    /// |∂τ_s/∂q̇| ≤ Σ |c_k|/v_k + |load| |b_l|      |∂τ_s/∂q| ≤ Σ 2 (|h_k| + |load| |l_k|)/δ_k
    /// ```
    pub(crate) fn slopes(&self, load: f64) -> (f64, f64) {
        let (mut of_speed, mut of_travel) = (0.0, 0.0);
        for law in &self.terms {
            let size = law.coefficient.abs();
            match law.term {
                FrictionTerm::Tanh { width } => of_speed += size / width,
                FrictionTerm::LoadSpeed => of_speed += size * load.abs(),
                FrictionTerm::Hysteresis { length } => of_travel += 2.0 * size / length,
                FrictionTerm::LoadHysteresis { length } => {
                    of_travel += 2.0 * size * load.abs() / length;
                }
                _ => {}
            }
        }
        (of_speed, of_travel)
    }
}

impl SmoothTorque {
    pub(crate) const NONE: Self = Self {
        own: 0.0,
        share: 0.0,
    };

    /// The torque under a load, N·m or N.
    #[inline]
    pub(crate) fn under(self, load: f64) -> f64 {
        self.own + load.abs() * self.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn friction() -> SmoothFriction {
        let length = 1e-3;
        SmoothFriction {
            offset: 0.25,
            tanh: vec![TanhFriction {
                width: 0.5,
                torque: 2.0,
            }],
            hysteresis: vec![HysteresisFriction {
                length,
                torque: 3.0,
            }],
            load_hysteresis: vec![
                LoadHysteresisFriction {
                    length,
                    coefficient: 0.1,
                },
                LoadHysteresisFriction {
                    length: 2e-3,
                    coefficient: 0.2,
                },
            ],
            load_viscous: 0.04,
        }
    }

    #[test]
    fn torque_worked_by_hand() {
        let mut springs = Vec::new();
        let law = SmoothLaw::new(4, &friction(), &mut springs);
        let lengths: Vec<f64> = springs.iter().map(|spring| spring.length).collect();
        assert_eq!(lengths, [1e-3, 2e-3]);
        let torque = law.at(0.5, |idx| [0.5, -1.0][idx]);
        // 0.25 + 2 tanh 1 + 3·0.5, and of the load 0.1·0.5 − 0.2 + 0.04·0.5
        let own = 0.25 + 2.0 * 1.0_f64.tanh() + 1.5;
        assert!((torque.own - own).abs() < 1e-15, "{torque:?}");
        assert!((torque.share + 0.13).abs() < 1e-15, "{torque:?}");
        assert!((torque.under(-10.0) - (own - 1.3)).abs() < 1e-14);
    }

    #[test]
    fn slopes_are_the_largest_that_differences_show() {
        let law = SmoothLaw::new(0, &friction(), &mut Vec::new());
        let (of_speed, of_travel) = law.slopes(7.0);
        let torque = |qd: f64| law.at(qd, |_| 0.0).under(7.0);
        let slope = (torque(1e-6) - torque(-1e-6)) / 2e-6;
        // Rounding of 0.25 N·m over 2 µrad/s, and the cube of a tanh.
        assert!((slope - of_speed).abs() < 1e-9, "{slope} {of_speed}");
        // A joint that has just turned back: ż = 2/δ, of 3 N·m and of 10 % and 20 % of the load.
        let worked_by_hand = 2.0 * (3.0 / 1e-3 + 0.7 / 1e-3 + 1.4 / 2e-3);
        assert!((of_travel - worked_by_hand).abs() < 1e-9, "{of_travel}");
    }
}
