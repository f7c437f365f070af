//! Minimisation in rounds, each in coordinates in which a metric of its start is the identity.

use faer::Mat;

use super::{
    Known, Metric, MinimizeOptions, Minimum, Objective, Resumed, Scaled, StopReason, minimize,
};

/// When the metric is renewed, and when it is no longer worth it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rounds {
    /// Evaluations of a round at most.
    pub evaluations: usize,
    /// What a round that ended by itself must have gained for another to follow, in units of the function.
    pub worth: f64,
}

/// Minimises a function by L-BFGS in rounds, each in the metric at its start.
///
/// ```text
/// |dz|² = dzᵀ G(z₀) dz,   z₀ the start of the round
/// ```
/// With the Hessian or the Fisher information for G, a narrow valley becomes round.
/// Where there is no metric, or it is not positive definite, the coordinates are z itself.
/// `options.max_evaluations` counts those of all rounds.
/// The value of the result is never above that at the start.
/// # Shapes
/// `start` (p,); `metric(z)` (p, p), of which the lower triangle is read.
/// # Source
/// Amari 1998 for the metric.
pub fn minimize_in_metric<O: Objective>(
    objective: &mut O,
    start: &[f64],
    mut metric: impl FnMut(&[f64]) -> Option<Mat<f64>>,
    options: &MinimizeOptions,
    rounds: Rounds,
) -> Minimum {
    let mut found: Option<Minimum> = None;
    loop {
        let used = found.as_ref().map_or(0, |before| before.evaluations);
        let of_round = MinimizeOptions {
            // The start of a later round is known and costs nothing.
            max_evaluations: options
                .max_evaluations
                .saturating_sub(used)
                .min(rounds.evaluations)
                + usize::from(found.is_some()),
            ..*options
        };
        let z = found.as_ref().map_or(start, |before| before.z.as_slice());
        let metric = metric(z).and_then(|g| Metric::new(g.as_ref()));
        let round = one_round(objective, z, found.as_ref(), metric, &of_round);
        let gain = found.as_ref().map_or(f64::INFINITY, |before| before.value) - round.value;
        let is_settled = round.stop != StopReason::EvaluationLimit;
        let whole = after(found, round);
        let is_over = whole.evaluations >= options.max_evaluations
            || whole.stop == StopReason::GradientSmall
            || !whole.value.is_finite()
            || (is_settled && gain < rounds.worth);
        if is_over {
            return whole;
        }
        found = Some(whole);
    }
}

/// One round; its result in the function's own coordinates.
fn one_round<O: Objective>(
    objective: &mut O,
    z: &[f64],
    before: Option<&Minimum>,
    metric: Option<Metric>,
    options: &MinimizeOptions,
) -> Minimum {
    let known = before.map(|before| Known {
        z: z.to_vec(),
        value: before.value,
        gradient: before.gradient.clone(),
    });
    let mut scaled = Scaled::new(Resumed::new(objective, known), z.to_vec(), metric);
    let start = scaled.start();
    let minimum = minimize(&mut scaled, &start, options);
    Minimum {
        z: scaled.outer(&minimum.z),
        gradient: scaled.outer_gradient(&minimum.gradient),
        evaluations: minimum.evaluations - usize::from(before.is_some()),
        ..minimum
    }
}

/// The rounds so far and a further one as one search.
fn after(before: Option<Minimum>, round: Minimum) -> Minimum {
    let Some(before) = before else {
        return round;
    };
    Minimum {
        start_value: before.start_value,
        iterations: before.iterations + round.iterations,
        evaluations: before.evaluations + round.evaluations,
        recoveries: before.recoveries + round.recoveries,
        ..round
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Σ_j c_j (z_j − 1)² + (z_0 − 1)⁴ with c from 1 to 10⁸, and its evaluations.
    struct Valley(usize);

    const CURVATURES: [f64; 5] = [1.0, 1e2, 1e4, 1e6, 1e8];

    impl Objective for Valley {
        fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
            self.0 += 1;
            let mut value = 0.0;
            for (idx, c) in CURVATURES.into_iter().enumerate() {
                let off = z[idx] - 1.0;
                gradient[idx] = 2.0 * c * off;
                value += c * off * off;
            }
            gradient[0] += 4.0 * (z[0] - 1.0).powi(3);
            value + (z[0] - 1.0).powi(4)
        }
    }

    fn hessian(z: &[f64]) -> Mat<f64> {
        Mat::from_fn(5, 5, |row, col| match row {
            _ if row != col => 0.0,
            0 => 2.0 + 12.0 * (z[0] - 1.0).powi(2),
            _ => 2.0 * CURVATURES[row],
        })
    }

    const OPTIONS: MinimizeOptions = MinimizeOptions {
        gradient_tolerance: 1e-6,
        value_tolerance: 0.0,
        max_evaluations: 200,
        max_recoveries: 3,
    };
    const ROUNDS: Rounds = Rounds {
        evaluations: 8,
        worth: 1e-9,
    };

    #[test]
    fn rounds_count_together_and_reach_what_no_single_one_does() {
        let mut valley = Valley(0);
        let start = CURVATURES.map(|c: f64| 1.0 + 5.0 / (2.0 * c).sqrt());
        let metric = |z: &[f64]| Some(hessian(z));
        let minimum = minimize_in_metric(&mut valley, &start, metric, &OPTIONS, ROUNDS);
        assert_eq!(minimum.stop, StopReason::GradientSmall, "{minimum:?}");
        assert_eq!(minimum.evaluations, valley.0);
        assert!(minimum.evaluations > ROUNDS.evaluations && minimum.value < 1e-12);
        // Five times c (z − 1)² = 25/2, and (5/√2)⁴ = 625/4; z − 1 has lost four digits.
        let at_start = 62.5 + 156.25;
        assert!((minimum.start_value / at_start - 1.0).abs() < 1e-10);
        let without = minimize_in_metric(&mut Valley(0), &start, |_| None, &OPTIONS, ROUNDS);
        assert!(minimum.evaluations < without.evaluations, "{without:?}");
    }

    #[test]
    fn evaluations_are_limited_over_all_rounds() {
        let options = MinimizeOptions {
            max_evaluations: 12,
            ..OPTIONS
        };
        let mut valley = Valley(0);
        let start = [1e3, -2.0, 5.0, 0.0, 4.0];
        let minimum = minimize_in_metric(&mut valley, &start, |_| None, &options, ROUNDS);
        assert_eq!((minimum.evaluations, valley.0), (12, 12));
        assert_eq!(minimum.stop, StopReason::EvaluationLimit);
        assert!(minimum.value < minimum.start_value);
    }
}
