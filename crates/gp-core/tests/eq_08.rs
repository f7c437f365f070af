//! Eq. (8): the log marginal likelihood and every entry of its gradient, against
//! 50-digit arithmetic.

use faer::mat;
use gp_core::evidence::log_marginal_likelihood_with_gradient;
use gp_core::log_marginal_likelihood;
use kernels::Constant;

use crate::fixture::{Case, case, conditioning_error, likelihood_rows};

/// Checks a case to `tolerance` relative to the likelihood, and to the largest gradient entry.
fn check(name: &str, tolerance: impl Fn(&Case) -> f64) {
    let case = case(name);
    let tolerance = tolerance(&case);
    let expected = likelihood_rows(name);
    let (value, gradient) = log_marginal_likelihood_with_gradient(
        &case.covariance,
        case.noise_std,
        case.x.as_ref(),
        &case.targets,
    )
    .unwrap();

    let error = (value - expected[0].2).abs() / expected[0].2.abs();
    assert!(
        error <= tolerance,
        "{name}: {value} {} error {error:e}",
        expected[0].2
    );
    assert_eq!(gradient.len(), expected.len() - 1);
    let largest = expected[1..]
        .iter()
        .fold(0.0, |l: f64, row| l.max(row.2.abs()));
    for (entry, row) in gradient.iter().zip(&expected[1..]) {
        let error = (entry - row.2).abs() / largest;
        assert!(
            error <= tolerance,
            "{name} {}: {entry} {} error {error:e}",
            row.0,
            row.2
        );
    }
}

#[test]
fn value_and_gradient_of_gpc() {
    // The worst case is n ε κ(K) < 1e-9, but t is not the worst right-hand side:
    // the error seen is 7e-15, and 1e-12 leaves room for other orders of summation.
    check("well", |case| {
        assert!(conditioning_error(case) <= 1e-9);
        1e-12
    });
}

#[test]
fn value_and_gradient_of_gp_without_friction() {
    check("smooth", |_| 1e-12);
}

#[test]
fn value_and_gradient_of_a_nearly_singular_matrix() {
    // t lies 5e2 noise levels off the leading eigenvectors: all of n ε κ can show.
    check("ill", conditioning_error);
}

#[test]
fn value_alone_equals_value_with_gradient() {
    let case = case("well");
    let x = case.x.as_ref();
    let alone = log_marginal_likelihood(&case.covariance, case.noise_std, x, &case.targets);
    let both =
        log_marginal_likelihood_with_gradient(&case.covariance, case.noise_std, x, &case.targets);
    assert_eq!(alone.unwrap(), both.unwrap().0);
}

#[test]
fn one_sample_is_a_normal_density() {
    // K = 3 + 1 = 4, t = 2: −½·4/4 − ½ ln 4 − ½ ln 2π.
    let covariance = Constant::new(3.0_f64.sqrt()).unwrap();
    let value = log_marginal_likelihood(&covariance, 1.0, mat![[0.0]].as_ref(), &[2.0]).unwrap();
    let by_hand = -0.5 - 2.0_f64.ln() - 0.5 * (2.0 * std::f64::consts::PI).ln();
    assert!(
        (value - by_hand).abs() <= 8.0 * f64::EPSILON,
        "{value} {by_hand}"
    );
}
