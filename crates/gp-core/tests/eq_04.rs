//! Eqs. (3)–(4): posterior mean and variance, against 50-digit arithmetic.

use gp_core::{Posterior, Prediction};
use kernels::{Covariance, TorqueCovariance};

use crate::fixture::{Case, D, case, conditioning_error, matrix, numbers, rows};

fn posterior(case: &Case) -> Posterior<TorqueCovariance> {
    Posterior::dense(
        case.covariance.clone(),
        case.noise_std,
        case.x.as_ref(),
        &case.targets,
    )
    .unwrap()
}

/// Predicts a case's points; returns predictions, expected means and variances.
fn predict(name: &str) -> (Prediction, Vec<Vec<f64>>, Vec<f64>) {
    let case = case(name);
    let expected: Vec<Vec<f64>> = rows("posterior.csv")
        .iter()
        .filter(|row| row[0] == name)
        .map(|row| numbers(&row[1..]))
        .collect();
    let points = matrix(&expected);
    let x = points.subcols(0, D);
    let prior = case.covariance.diag(x);
    (posterior(&case).predict(x).unwrap(), expected, prior)
}

/// Means to `tolerance` relative to the largest mean; variances relative to the prior.
fn check(name: &str, tolerance: f64) {
    let (prediction, expected, prior) = predict(name);
    let scale = expected.iter().fold(0.0, |l: f64, row| l.max(row[D].abs()));
    for (idx, row) in expected.iter().enumerate() {
        let (mean, var) = (prediction.mean[idx], prediction.var[idx]);
        let error = (mean - row[D]).abs() / scale;
        assert!(
            error <= tolerance,
            "{name} {idx}: mean {mean} {} {error:e}",
            row[D]
        );
        let error = (var - row[D + 1]).abs() / prior[idx];
        assert!(
            error <= tolerance,
            "{name} {idx}: var {var} {} {error:e}",
            row[D + 1]
        );
    }
}

#[test]
fn mean_and_variance_of_gpc() {
    // The error seen is 1e-15, see eq_08.
    check("well", 1e-12);
    check("smooth", 1e-12);
}

#[test]
fn mean_and_variance_of_a_nearly_singular_matrix() {
    check("ill", conditioning_error(&case("ill")));
}

#[test]
fn blocks_of_test_points_do_not_change_a_prediction() {
    let case = case("well");
    let posterior = posterior(&case);
    // 300 points: two full blocks of 128 and a part.
    let points = faer::Mat::from_fn(300, D, |row, col| {
        (0.37 * row as f64 + 1.1 * col as f64).sin()
    });
    let together = posterior.predict(points.as_ref()).unwrap();
    let means = posterior.predict_mean(points.as_ref()).unwrap();
    assert_eq!(together.mean, means);
    for idx in [0, 127, 128, 255, 256, 299] {
        let alone = posterior.predict(points.subrows(idx, 1)).unwrap();
        // The matrix products sum their terms in another order: d ε per covariance.
        let tolerance = 1e3 * D as f64 * f64::EPSILON;
        assert!((alone.mean[0] - together.mean[idx]).abs() <= tolerance * 20.0);
        assert!((alone.var[0] - together.var[idx]).abs() <= tolerance);
    }
}

#[test]
fn variances_below_zero_are_counted() {
    let case = case("ill");
    let prediction = posterior(&case).predict(case.x.as_ref()).unwrap();
    assert!(prediction.var.iter().all(|var| *var >= 0.0));
    let zeros = prediction.var.iter().filter(|var| **var == 0.0).count();
    assert_eq!(prediction.n_clamped, zeros);
}
