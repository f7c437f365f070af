//! Whether a joint's positions are places on the circle, judged from the positions alone.

use std::f64::consts::{PI, TAU};

use faer::MatRef;
use kernels::ContinuousJoints;

/// Largest gap between neighbours on the circle that counts as none: a twelfth of a turn.
///
/// Torques change with a joint's angle as its sine does at the fastest, and what lies a twelfth of a turn between two
/// samples is well known from both; positions at random leave no larger gap from some 60 rows on.
pub(crate) const LARGEST_GAP: f64 = PI / 6.0;

/// What positions that are written modulo a turn may lie outside of it, rad: rounding and noise of an encoder.
const NOISE: f64 = 0.01;

/// How some positions of a joint lie on the circle and on the line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleCover {
    /// Smallest position, rad.
    pub min: f64,
    /// Largest position, rad.
    pub max: f64,
    /// Largest difference of neighbours among the angles modulo 2π, rad; 2π of one position.
    pub largest_gap: f64,
}

impl CircleCover {
    /// Of one position or more.
    ///
    /// `None` of none, or where a position is not finite.
    pub fn of(positions: impl IntoIterator<Item = f64>) -> Option<Self> {
        let positions: Vec<f64> = positions.into_iter().collect();
        if !positions.iter().all(|q| q.is_finite()) {
            return None;
        }
        let mut angles: Vec<f64> = positions.iter().map(|q| q.rem_euclid(TAU)).collect();
        angles.sort_by(f64::total_cmp);
        let (first, last) = (*angles.first()?, *angles.last()?);
        let gaps = angles.windows(2).map(|pair| pair[1] - pair[0]);
        Some(Self {
            min: positions.iter().copied().fold(f64::INFINITY, f64::min),
            max: positions.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            largest_gap: gaps.fold(first + TAU - last, f64::max),
        })
    }

    /// Whether they fill the circle, and are written modulo a turn: from −π to π or from 0 to 2π.
    ///
    /// ```text
    /// largest gap ≤ π/6   and   −π ≤ q ≤ π or 0 ≤ q ≤ 2π, to 0.01 rad
    /// ```
    /// So a joint that slides is not taken for one that turns unless its positions fill just such a stretch of 6.28 m.
    pub fn is_one_turn(&self) -> bool {
        let is_within = |low: f64, high: f64| self.min >= low - NOISE && self.max <= high + NOISE;
        self.largest_gap <= LARGEST_GAP && (is_within(-PI, PI) || is_within(0.0, TAU))
    }

    /// Whether they fill the circle and go beyond one turn: a joint that turns without end, or one that slides far.
    pub fn is_several_turns(&self) -> bool {
        self.largest_gap <= LARGEST_GAP && self.max - self.min > TAU + 2.0 * NOISE
    }
}

/// The joints whose positions fill one turn and are written modulo it: see [`CircleCover::is_one_turn`].
///
/// # Shapes
/// `x` (n, 3ℓ), columns (q, q̇, q̈).
/// # Panics
/// If x has fewer than ℓ columns.
pub fn joints_of_one_turn(x: MatRef<'_, f64>, n_joints: usize) -> ContinuousJoints {
    let fills = |joint: &usize| {
        let cover = CircleCover::of(x.col(*joint).iter().copied());
        cover.is_some_and(|cover| cover.is_one_turn())
    };
    ContinuousJoints::of((0..n_joints).filter(fills))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n positions from `low` to `high`, both among them.
    fn cover(low: f64, high: f64, n: u32) -> CircleCover {
        let step = (high - low) / f64::from(n - 1);
        CircleCover::of((0..n).map(|idx| low + step * f64::from(idx))).expect("positions")
    }

    #[test]
    fn the_gap_is_the_largest_on_the_circle_also_across_its_seam() {
        // 3.0 and −3.0 are 2π − 6 apart, and from −3 to 0 it is 3.
        let found = CircleCover::of([3.0, -3.0, 0.0]).expect("positions");
        assert!(
            (found.largest_gap - 3.0).abs() <= 4.0 * f64::EPSILON,
            "{found:?}"
        );
        let alone = CircleCover::of([1.5]).expect("a position");
        assert!((alone.largest_gap - TAU).abs() <= 4.0 * f64::EPSILON);
        assert_eq!(CircleCover::of([]), None);
        assert_eq!(CircleCover::of([0.0, f64::NAN]), None);
    }

    #[test]
    fn encoders_write_one_turn_in_two_ways() {
        for (low, high) in [(-3.1, 3.1), (0.0, 6.25), (-PI - 0.005, PI + 0.005)] {
            let found = cover(low, high, 200);
            assert!(
                found.is_one_turn() && !found.is_several_turns(),
                "{found:?}"
            );
        }
    }

    #[test]
    fn rails_and_arms_with_limits_are_no_turn() {
        // Rails of 4, 6.28 and 12 m about elsewhere than 0; a joint of ±150°, and one seen at ten places.
        for (low, high, n) in [
            (0.0, 4.0, 200),
            (-1.0, 5.28, 200),
            (-2.6, 2.6, 200),
            (-PI, PI, 10),
        ] {
            let found = cover(low, high, n);
            assert!(
                !found.is_one_turn() && !found.is_several_turns(),
                "{found:?}"
            );
        }
        let long = cover(-6.0, 6.0, 200);
        assert!(!long.is_one_turn() && long.is_several_turns());
    }
}
