//! Which joints friction holds at rest: Coulomb's law as a set-valued force.
//!
//! A joint that moves has the Coulomb torque of its direction.
//! A joint at rest has any torque between the two, and takes the one that keeps it at rest if there
//! is one:
//!
//! ```text
//! q̇ > 0: f = f⁺      q̇ < 0: f = f⁻      q̇ = 0: f⁻ ≤ f ≤ f⁺, and q̈ (f − f') ≥ 0 for all f' in [f⁻, f⁺]
//! ```
//! With M q̈ = r − f for all joints, q̈ is the one minimiser of a strictly convex function,
//!
//! ```text
//! ½ q̈ᵀM q̈ − q̈ᵀr + Σ_moving f q̈ + Σ_resting max(f⁺ q̈, f⁻ q̈)
//! ```
//! which Gauss–Seidel finds joint by joint, each friction torque projected onto its interval.
//!
//! # Source
//! Lötstedt 1981, "Coulomb friction in two-dimensional rigid body systems"; Moreau 1988, "Unilateral
//! contact and dry friction in finite freedom dynamics"; Acary & Brogliato 2008, *Numerical Methods
//! for Nonsmooth Dynamical Systems*, ch. 8 (event-driven schemes) and sec. 12.4 (projected
//! Gauss–Seidel).

use crate::robot::friction_law::Law;

/// Sweeps after which the search is given up; a handful is usual.
const MOST_SWEEPS: usize = 20_000;
/// Change of a torque, relative to the largest, below which a sweep has changed nothing.
const SETTLED: f64 = 1e-13;

/// What Coulomb friction does to a joint, until the next event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SlipMode {
    /// The joint has neither Coulomb friction nor friction with memory.
    Frictionless,
    /// It is at rest and stays there.
    Sticking,
    /// It moves, or is about to move, in the positive direction.
    Positive,
    /// It moves, or is about to move, in the negative direction.
    Negative,
}

impl SlipMode {
    /// The mode of a joint that moves; `None` at rest, where the other joints have a say.
    ///
    /// Friction that remembers, as `has_memory` says, asks for the direction even without Coulomb friction.
    pub(crate) fn of_moving(law: &Law, has_memory: bool, qd: f64) -> Option<Self> {
        let (negative, positive) = law.at_rest();
        if positive <= 0.0 && negative >= 0.0 && !has_memory {
            Some(Self::Frictionless)
        } else if qd > 0.0 {
            Some(Self::Positive)
        } else if qd < 0.0 {
            Some(Self::Negative)
        } else {
            None
        }
    }

    /// Speed in the direction of the mode: below zero, the mode has ended.
    pub(crate) fn forward_speed(self, qd: f64) -> f64 {
        match self {
            Self::Positive => qd,
            Self::Negative => -qd,
            Self::Frictionless | Self::Sticking => f64::INFINITY,
        }
    }

    /// Coulomb torque while the mode lasts; that of a sticking joint is a reaction, not a law.
    pub(crate) fn coulomb(self, law: &Law) -> f64 {
        let (negative, positive) = law.at_rest();
        match self {
            Self::Positive => positive,
            Self::Negative => negative,
            Self::Frictionless | Self::Sticking => 0.0,
        }
    }
}

/// Decides for the joints at rest, given what would accelerate them.
///
/// `None` in `modes` marks a joint at rest; on return it is `Some`.
///
/// # Shapes
/// `inertia_matrix` (n, n) row after row; `drive` r (n,), with the Coulomb torques of moving joints
/// already taken off; `bounds` (n,) what friction can be at rest; `modes` and the scratch `qdd` (n,).
///
/// # Returns
/// Whether the search settled.
pub(crate) fn settle(
    inertia_matrix: &[f64],
    drive: &[f64],
    bounds: &[(f64, f64)],
    modes: &mut [Option<SlipMode>],
    qdd: &mut [f64],
) -> bool {
    let n = drive.len();
    let scale = drive.iter().fold(0.0, |scale: f64, r| scale.max(r.abs()));
    qdd.fill(0.0);
    let mut is_settled = false;
    for _ in 0..MOST_SWEEPS {
        let mut largest_change: f64 = 0.0;
        for i in 0..n {
            let row = &inertia_matrix[i * n..(i + 1) * n];
            let others: f64 = row.iter().zip(&*qdd).map(|(m, a)| m * a).sum();
            let own = row[i];
            let torque = drive[i] - (others - own * qdd[i]);
            let left = torque - friction_at_rest(bounds[i], modes[i], torque);
            largest_change = largest_change.max((left - own * qdd[i]).abs());
            qdd[i] = left / own;
        }
        if largest_change <= SETTLED * scale {
            is_settled = true;
            break;
        }
    }
    for (mode, qdd) in modes.iter_mut().zip(qdd) {
        mode.get_or_insert(if *qdd > 0.0 {
            SlipMode::Positive
        } else if *qdd < 0.0 {
            SlipMode::Negative
        } else {
            SlipMode::Sticking
        });
    }
    is_settled
}

/// The projection: friction of a joint at rest under a torque; a moving joint's is in the drive.
fn friction_at_rest(bounds: (f64, f64), mode: Option<SlipMode>, torque: f64) -> f64 {
    match mode {
        None => torque.clamp(bounds.0, bounds.1),
        Some(_) => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settled(matrix: &[f64], drive: &[f64], laws: &[(f64, f64)]) -> Vec<Option<SlipMode>> {
        let mut modes = vec![None; drive.len()];
        let mut qdd = vec![0.0; drive.len()];
        assert!(settle(matrix, drive, laws, &mut modes, &mut qdd));
        modes
    }

    #[test]
    fn one_joint_worked_by_hand() {
        let laws = [(-2.0, 3.0)];
        for (torque, expected) in [
            (2.9, SlipMode::Sticking),
            (3.1, SlipMode::Positive),
            (-1.9, SlipMode::Sticking),
            (-2.1, SlipMode::Negative),
        ] {
            assert_eq!(settled(&[0.5], &[torque], &laws), [Some(expected)]);
        }
    }

    #[test]
    fn a_joint_that_lets_go_can_take_another_along() {
        // M = (2 1; 1 1), r = (10, 0.5), friction ±1 at joint 2 and none to speak of at joint 1.
        // Joint 1 alone: q̈1 = 5. It pulls joint 2 by −5, more than friction holds: joint 2 goes back.
        let laws = [(-0.1, 0.1), (-1.0, 1.0)];
        let modes = settled(&[2.0, 1.0, 1.0, 1.0], &[10.0, 0.5], &laws);
        assert_eq!(modes, [Some(SlipMode::Positive), Some(SlipMode::Negative)]);
        // With a friction of ±6 it holds.
        let laws = [(-0.1, 0.1), (-6.0, 6.0)];
        let modes = settled(&[2.0, 1.0, 1.0, 1.0], &[10.0, 0.5], &laws);
        assert_eq!(modes, [Some(SlipMode::Positive), Some(SlipMode::Sticking)]);
    }

    #[test]
    fn every_joint_obeys_newton_and_coulomb() {
        // M = A Aᵀ + 0.1 with entries of A, r and the friction from a fixed rule.
        let number = |k: usize| ((k * 37 + 11) % 101) as f64 / 50.0 - 1.0;
        let n = 5;
        for case in 0..200 {
            let a = |i: usize, j: usize| number(case * 31 + i * n + j);
            let entry = |i: usize, j: usize| {
                let sum: f64 = (0..n).map(|k| a(i, k) * a(j, k)).sum();
                sum + if i == j { 0.1 } else { 0.0 }
            };
            let matrix: Vec<f64> = (0..n * n).map(|k| entry(k / n, k % n)).collect();
            let drive: Vec<f64> = (0..n).map(|i| 3.0 * number(case * 7 + i)).collect();
            let bound = |k: usize| 1.0 + number(case * 13 + k);
            let laws: Vec<(f64, f64)> = (0..n)
                .map(|i| (-bound(i) - 0.01, bound(i + 50) + 0.01))
                .collect();
            let (mut modes, mut qdd) = (vec![None; n], vec![0.0; n]);
            assert!(
                settle(&matrix, &drive, &laws, &mut modes, &mut qdd),
                "case {case}"
            );
            for i in 0..n {
                let inertial: f64 = (0..n).map(|j| matrix[i * n + j] * qdd[j]).sum();
                let friction = drive[i] - inertial;
                let (negative, positive) = laws[i];
                // SETTLED relative to a drive of at most 3, through a condition of a thousand.
                let near = |torque: f64| (friction - torque).abs() < 1e-9;
                let obeys = match modes[i] {
                    Some(SlipMode::Positive) => qdd[i] > 0.0 && near(positive),
                    Some(SlipMode::Negative) => qdd[i] < 0.0 && near(negative),
                    Some(SlipMode::Sticking) => {
                        (negative - 1e-9..=positive + 1e-9).contains(&friction)
                    }
                    _ => false,
                };
                assert!(
                    obeys,
                    "case {case}, joint {i}: {:?} {friction} {}",
                    modes[i], qdd[i]
                );
            }
        }
    }
}
