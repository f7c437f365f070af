//! The posterior covariance between points, against eq. (4) written out with an explicit inverse.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Side};
use gp_core::{GpError, LikelihoodOptions, Method, Posterior};
use kernels::Covariance;

use crate::curves;
use crate::fixture::{D, case, conditioning_error};

/// c(X*, X*) − k K⁻¹ kᵀ entry by entry.
fn textbook<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    x: &Mat<f64>,
    points: &Mat<f64>,
) -> Mat<f64> {
    let mut k_xx = covariance.gram(x.as_ref());
    for idx in 0..x.nrows() {
        k_xx[(idx, idx)] += noise_std * noise_std;
    }
    let inverse = k_xx.llt(Side::Lower).unwrap().inverse();
    let k_sx = covariance.cross(points.as_ref(), x.as_ref());
    covariance.gram(points.as_ref()) - &k_sx * inverse * k_sx.transpose()
}

fn assert_symmetric(matrix: &Mat<f64>) {
    for row in 0..matrix.nrows() {
        for col in 0..row {
            assert_eq!(matrix[(row, col)], matrix[(col, row)], "({row}, {col})");
        }
    }
}

#[test]
fn dense_covariance_is_that_of_the_textbook() {
    let case = case("well");
    // Points on, near and far from the data.
    let points = Mat::from_fn(9, D, |row, col| match row % 3 {
        0 => case.x[(row, col)],
        1 => case.x[(row, col)] + 0.1,
        _ => 3.0 * (row as f64 + 1.7 * col as f64).sin(),
    });
    let (covariance, noise_std) = (case.covariance.clone(), case.noise_std);
    let expected = textbook(&covariance, noise_std, &case.x, &points);
    let tolerance = conditioning_error(&case) * covariance.gram(points.as_ref()).norm_max();
    let posterior =
        Posterior::dense(covariance, noise_std, case.x.as_ref(), &case.targets).unwrap();
    let found = posterior.predict_covariance(points.as_ref()).unwrap();
    let difference = (&found - expected).norm_max();
    assert!(difference <= tolerance, "{difference:e} {tolerance:e}");
    assert_symmetric(&found);
    let variances = posterior.predict_var(points.as_ref()).unwrap();
    for (idx, var) in variances.iter().enumerate() {
        let error = (found[(idx, idx)] - var).abs();
        assert!(error <= tolerance, "{idx}: {var} {error:e}");
    }
}

#[test]
fn low_rank_covariance_is_near_the_dense_one() {
    let (x, noise_std) = (curves::inputs(300), 0.03);
    let points = Mat::from_fn(40, 18, |row, col| {
        x[(7 * row, col)] + [0.0, 0.05, 3.0][row % 3] * (col as f64).cos()
    });
    let covariance = curves::covariance(4.0);
    let targets = curves::targets(&x);
    // An explicit inverse would lose 1e-6 here: κ(K) is near 1e8, the prior variance near 300.
    let dense = Posterior::dense(covariance.clone(), noise_std, x.as_ref(), &targets).unwrap();
    let expected = dense.predict_covariance(points.as_ref()).unwrap();
    let options = LikelihoodOptions {
        method: Method::Certified,
        certificate: 1e-6,
    };
    let posterior = Posterior::new(covariance, noise_std, x.as_ref(), &targets, options).unwrap();
    assert!(posterior.rank() < 150, "{}", posterior.rank());
    let found = posterior.predict_covariance(points.as_ref()).unwrap();
    assert_symmetric(&found);
    let variances = posterior.predict_var(points.as_ref()).unwrap();
    for row in 0..40 {
        let (var, joint) = (variances[row], found[(row, row)]);
        assert!(
            (var - joint).abs() <= 1e-9 * (1.0 + var),
            "{row}: {var} {joint}"
        );
        for col in 0..=row {
            // Of the size that the variances may be wrong by in tests/low_rank_posterior.rs.
            let size = (expected[(row, row)] * expected[(col, col)]).sqrt();
            let error = (found[(row, col)] - expected[(row, col)]).abs();
            assert!(
                error <= 0.01 * size + 1e-9,
                "({row}, {col}): {error:e} {size:e}"
            );
        }
    }
}

#[test]
fn points_that_do_not_fit_are_refused() {
    let case = case("well");
    let posterior = Posterior::dense(
        case.covariance.clone(),
        case.noise_std,
        case.x.as_ref(),
        &case.targets,
    )
    .unwrap();
    let narrow = posterior.predict_covariance(Mat::zeros(2, D - 1).as_ref());
    let expected = GpError::WrongCovariates {
        found: D - 1,
        expected: D,
    };
    assert_eq!(narrow.unwrap_err(), expected);
    let mut missing = Mat::zeros(2, D);
    missing[(1, 2)] = f64::NAN;
    let error = posterior.predict_covariance(missing.as_ref()).unwrap_err();
    assert!(matches!(
        error,
        GpError::NonFiniteInput {
            row: 1,
            column: 2,
            ..
        }
    ));
}
