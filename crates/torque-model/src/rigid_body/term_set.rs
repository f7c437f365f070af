//! Sets of terms that a joint's friction is made of.

use puma_dyn::robot::FrictionTerm;

use FrictionTerm::{
    Acceleration, Hysteresis, LoadHysteresis, LoadSpeed, Offset, Speed, StepDown, StepUp, Tanh,
};

/// Length of the hysteresis that a few terms have, rad.
const SHORT: f64 = 5e-4;
/// Length of the other one that the full set has, rad.
const LONG: f64 = 2e-3;

/// A set of friction terms; each of the smooth ones holds the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TermSet {
    /// q̈, q̇, tanh(q̇/0.02).
    Tanh,
    /// The same, an offset, tanh(q̇/0.3) and hysteresis within 0.5 mrad.
    Minimal,
    /// The same, and hysteresis and viscosity that grow with the joint's load.
    Standard,
    /// The same, four more widths of tanh and hysteresis within 2 mrad.
    Full,
    /// q̈, q̇, [q̇ > 0], [q̇ < 0]: exact where friction is, as in the chapter's simulation.
    Signs,
}

impl TermSet {
    /// All, the simplest first; signs, which jump, behind the smooth ones.
    pub const ALL: [Self; 5] = [
        Self::Tanh,
        Self::Minimal,
        Self::Standard,
        Self::Full,
        Self::Signs,
    ];

    /// Its name in options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tanh => "tanh",
            Self::Minimal => "minimal",
            Self::Standard => "standard",
            Self::Full => "full",
            Self::Signs => "signs",
        }
    }

    /// Its terms, in their order.
    pub fn terms(self) -> &'static [FrictionTerm] {
        match self {
            Self::Tanh => &TANH,
            Self::Minimal => &MINIMAL,
            Self::Standard => &STANDARD,
            Self::Full => &FULL,
            Self::Signs => &SIGNS,
        }
    }

    /// Whether a term needs a hysteresis state.
    pub fn remembers(self) -> bool {
        self.terms().iter().any(|term| term.length().is_some())
    }

    /// The terms of any of some sets, in the order of the largest.
    pub(crate) fn union(sets: &[Self]) -> Vec<FrictionTerm> {
        let smooth = sets.iter().filter(|set| **set != Self::Signs).max();
        let mut terms = smooth.map_or(Vec::new(), |set| set.terms().to_vec());
        if sets.contains(&Self::Signs) {
            let missing = SIGNS.iter().filter(|term| !terms.contains(term));
            let missing: Vec<FrictionTerm> = missing.copied().collect();
            terms.extend(missing);
        }
        terms
    }
}

const TANH: [FrictionTerm; 3] = [Acceleration, Speed, Tanh { width: 0.02 }];

const MINIMAL: [FrictionTerm; 6] = [
    Acceleration,
    Speed,
    Offset,
    Tanh { width: 0.02 },
    Tanh { width: 0.3 },
    Hysteresis { length: SHORT },
];

const STANDARD: [FrictionTerm; 8] = [
    Acceleration,
    Speed,
    Offset,
    Tanh { width: 0.02 },
    Tanh { width: 0.3 },
    Hysteresis { length: SHORT },
    LoadHysteresis { length: SHORT },
    LoadSpeed,
];

const FULL: [FrictionTerm; 13] = [
    Acceleration,
    Speed,
    Offset,
    Tanh { width: 0.005 },
    Tanh { width: 0.02 },
    Tanh { width: 0.05 },
    Tanh { width: 0.1 },
    Tanh { width: 0.3 },
    Tanh { width: 1.0 },
    Hysteresis { length: SHORT },
    Hysteresis { length: LONG },
    LoadHysteresis { length: SHORT },
    LoadSpeed,
];

const SIGNS: [FrictionTerm; 4] = [Acceleration, Speed, StepUp, StepDown];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_smooth_set_holds_the_one_before() {
        for pair in TermSet::ALL[..4].windows(2) {
            let larger = pair[1].terms();
            assert!(pair[0].terms().iter().all(|term| larger.contains(term)));
        }
    }

    #[test]
    fn a_union_has_each_term_once() {
        let both = TermSet::union(&[TermSet::Signs, TermSet::Minimal, TermSet::Tanh]);
        assert_eq!(both.len(), MINIMAL.len() + 2);
        assert_eq!(TermSet::union(&[TermSet::Signs]), SIGNS);
    }
}
