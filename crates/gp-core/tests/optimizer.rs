//! The optimiser on functions that break ordinary line searches.

use gp_core::optimize::{MinimizeOptions, Objective, StopReason, minimize};

struct Function<F>(F);

impl<F: FnMut(&[f64], &mut [f64]) -> f64> Objective for Function<F> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        (self.0)(z, gradient)
    }
}

fn options() -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: 1e-6,
        value_tolerance: 1e-14,
        max_evaluations: 500,
        max_recoveries: 10,
    }
}

/// Rosenbrock's chain in p dimensions, with its minimum 0 at (1, …, 1).
fn chain(z: &[f64], gradient: &mut [f64]) -> f64 {
    gradient.fill(0.0);
    let mut value = 0.0;
    for j in 0..z.len() - 1 {
        let (slope, drop) = (1.0 - z[j], z[j + 1] - z[j] * z[j]);
        value += slope * slope + 100.0 * drop * drop;
        gradient[j] += -2.0 * slope - 400.0 * z[j] * drop;
        gradient[j + 1] += 200.0 * drop;
    }
    value
}

#[test]
fn curved_valley_is_followed_to_its_end() {
    let minimum = minimize(&mut Function(chain), &[-1.0; 20], &options());
    assert_eq!(minimum.stop, StopReason::GradientSmall);
    // Rosenbrock's chain has a second minimum near (−1, 1, …, 1), of value 3.99.
    assert!(
        minimum.value < 1e-12 || (minimum.value - 3.99).abs() < 0.02,
        "{}",
        minimum.value
    );
    let minimum = minimize(&mut Function(chain), &[0.0; 20], &options());
    assert!(minimum.value < 1e-12, "{}", minimum.value);
}

#[test]
fn undefined_regions_are_backed_away_from() {
    // −log(1 − z) + … is defined for z < 1 only; the first step overshoots.
    let barrier = |z: &[f64], gradient: &mut [f64]| {
        if z[0] >= 1.0 {
            return f64::INFINITY;
        }
        gradient[0] = 1.0 / (1.0 - z[0]) - 50.0;
        -(1.0 - z[0]).ln() - 50.0 * z[0]
    };
    let minimum = minimize(&mut Function(barrier), &[-5.0], &options());
    assert_eq!(minimum.stop, StopReason::GradientSmall);
    assert!((minimum.z[0] - 0.98).abs() < 1e-8, "{:?}", minimum.z);
}

#[test]
fn wrong_gradient_is_not_taken_for_convergence() {
    // Uphill gradients make every line search fail; the report must say so.
    let liar = |z: &[f64], gradient: &mut [f64]| {
        gradient[0] = -2.0 * z[0];
        z[0] * z[0]
    };
    let minimum = minimize(&mut Function(liar), &[3.0], &options());
    assert_eq!(minimum.stop, StopReason::ValueStalled);
    assert!(minimum.recoveries > 0);
    assert!(minimum.projected_gradient > 1.0);
}

#[test]
fn start_outside_the_domain_is_reported() {
    let nowhere = |_: &[f64], _: &mut [f64]| f64::INFINITY;
    let minimum = minimize(&mut Function(nowhere), &[3.0], &options());
    assert_eq!(minimum.stop, StopReason::StartUndefined);
    assert_eq!(minimum.evaluations, 1);
}

#[test]
fn evaluations_are_counted_and_capped() {
    let mut calls = 0;
    let mut counted = Function(|z: &[f64], gradient: &mut [f64]| {
        calls += 1;
        chain(z, gradient)
    });
    let few = MinimizeOptions {
        max_evaluations: 12,
        ..options()
    };
    let minimum = minimize(&mut counted, &[-1.0; 20], &few);
    assert_eq!(minimum.stop, StopReason::EvaluationLimit);
    assert_eq!((minimum.evaluations, calls), (12, 12));
}

#[test]
fn badly_scaled_bowl_is_crossed() {
    // Curvatures from 1e-3 to 1e3, and a first gradient of 1e4.
    let bowl = |z: &[f64], gradient: &mut [f64]| {
        let mut value = 0.0;
        for (j, (z, g)) in z.iter().zip(gradient).enumerate() {
            let curvature = 10.0_f64.powf(j as f64 - 3.0);
            *g = curvature * z;
            value += 0.5 * curvature * z * z;
        }
        value
    };
    let minimum = minimize(&mut Function(bowl), &[10.0; 7], &options());
    assert_eq!(minimum.stop, StopReason::GradientSmall);
}
