//! Bad data is refused with its place; degenerate data is not an error.

use faer::{Mat, mat};
use gp_core::fit::{chapter_start, fit_from};
use gp_core::{BayesLinear, FitOptions, GpError, LinearForm, Posterior, fit};
use kernels::{ContinuousJoints, TorqueCovariance, TorqueForm};

use crate::samples::uniform_inputs;

fn error_of(x: &Mat<f64>, targets: &[f64]) -> GpError {
    fit(
        x.as_ref(),
        targets,
        TorqueForm::Coulomb,
        &FitOptions::chapter(),
    )
    .unwrap_err()
}

#[test]
fn bad_numbers_are_named_by_row_and_column() {
    let mut x = uniform_inputs(1, 5, 3);
    let mut targets = vec![1.0, 2.0, 3.0, 4.0, 5.0];
    targets[3] = f64::INFINITY;
    let error = error_of(&x, &targets);
    let expected = GpError::NonFiniteTarget {
        row: 3,
        value: f64::INFINITY,
    };
    assert_eq!(error, expected);
    x[(2, 1)] = f64::NAN;
    let error = error_of(&x, &targets);
    assert!(
        matches!(error, GpError::NonFiniteInput { row: 2, column: 1, value } if value.is_nan())
    );
    assert_eq!(
        error.to_string(),
        "input at row 2, column 1 is NaN, not a finite number"
    );
}

#[test]
fn bad_shapes_are_errors() {
    let x = uniform_inputs(2, 4, 3);
    let mismatch = GpError::CountMismatch {
        n_inputs: 4,
        n_targets: 3,
    };
    assert_eq!(error_of(&x, &[1.0; 3]), mismatch);
    let one = x.subrows(0, 1).to_owned();
    let few = GpError::TooFewSamples {
        n_samples: 1,
        needed: 2,
    };
    assert_eq!(error_of(&one, &[1.0]), few);
    let four_columns = uniform_inputs(2, 4, 4);
    assert_eq!(
        error_of(&four_columns, &[1.0; 4]),
        GpError::NotThreePerJoint { columns: 4 }
    );
}

#[test]
fn predictions_refuse_other_widths_and_bad_numbers() {
    let x = uniform_inputs(3, 6, 3);
    let covariance = TorqueCovariance::unit(1, TorqueForm::Coulomb);
    let posterior = Posterior::dense(covariance, 0.1, x.as_ref(), &[1.0; 6]).unwrap();
    let wide = GpError::WrongCovariates {
        found: 6,
        expected: 3,
    };
    assert_eq!(posterior.predict(Mat::zeros(2, 6).as_ref()), Err(wide));
    let bad = mat![[0.0, 0.0, f64::NEG_INFINITY]];
    assert!(posterior.predict_mean(bad.as_ref()).is_err());
    let linear = BayesLinear::fit(x.as_ref(), &[1.0; 6], LinearForm::Smooth).unwrap();
    assert!(linear.predict_var(bad.as_ref()).is_err());
}

#[test]
fn noise_that_is_not_positive_is_an_error() {
    let x = uniform_inputs(3, 6, 3);
    let covariance = TorqueCovariance::unit(1, TorqueForm::Smooth);
    let error = Posterior::dense(covariance, 0.0, x.as_ref(), &[1.0; 6]).unwrap_err();
    assert_eq!(error, GpError::BadNoise { value: 0.0 });
}

#[test]
fn degenerate_data_can_be_fitted() {
    let spread = uniform_inputs(4, 12, 3);
    let mut constant_column = spread.clone();
    let mut repeated = spread.clone();
    for row in 0..12 {
        constant_column[(row, 1)] = 0.1;
        for col in 0..3 {
            repeated[(row, col)] = spread[(row % 2, col)];
        }
    }
    let ramp: Vec<f64> = (0..12).map(f64::from).collect();
    let huge: Vec<f64> = ramp.iter().map(|t| 1e9 * t).collect();
    let cases: [(&str, &Mat<f64>, Vec<f64>); 5] = [
        ("zero targets", &spread, vec![0.0; 12]),
        ("equal targets", &spread, vec![7.0; 12]),
        ("constant column", &constant_column, ramp.clone()),
        ("repeated inputs", &repeated, ramp),
        ("huge targets", &spread, huge),
    ];
    for (name, x, targets) in cases {
        for form in [TorqueForm::Smooth, TorqueForm::Coulomb] {
            let found = fit(x.as_ref(), &targets, form, &FitOptions::several());
            let found = found.unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(found.report.log_marginal.is_finite(), "{name}");
            let means = found.posterior.predict_mean(x.as_ref()).unwrap();
            assert!(means.iter().all(|mean| mean.is_finite()), "{name}");
        }
    }
}

#[test]
fn starts_of_another_robot_and_no_starts_are_errors() {
    let (one_joint, two_joints) = (uniform_inputs(5, 6, 3), uniform_inputs(5, 6, 6));
    let targets = [1.0, -1.0, 2.0, 0.5, 0.0, 1.5];
    let options = FitOptions::several();
    let other = chapter_start(
        two_joints.as_ref(),
        &targets,
        TorqueForm::Coulomb,
        &ContinuousJoints::none(),
    )
    .unwrap();
    let error = fit_from(one_joint.as_ref(), &targets, &[other], &options).unwrap_err();
    let expected = GpError::WrongCovariates {
        found: 3,
        expected: 6,
    };
    assert_eq!(error, expected);
    let error = fit_from(one_joint.as_ref(), &targets, &[], &options).unwrap_err();
    assert_eq!(
        error,
        GpError::NoUsableStart {
            n_starts: 0,
            reason: None
        }
    );
}

#[test]
fn starts_that_fail_alike_say_why() {
    let x = uniform_inputs(5, 6, 3);
    let targets = [1.0, -1.0, 2.0, 0.5, 0.0, 1.5];
    let mut start = chapter_start(
        x.as_ref(),
        &targets,
        TorqueForm::Coulomb,
        &ContinuousJoints::none(),
    )
    .unwrap();
    let mut params = start.covariance.named_params();
    params.signal_std = 1e9;
    start.covariance = TorqueCovariance::new(params).unwrap();
    start.noise_std = 0.1;
    let starts = [start.clone(), start];
    let error = fit_from(x.as_ref(), &targets, &starts, &FitOptions::several()).unwrap_err();
    // n ε v²/σ² = 6 · 2.2e-16 · 1e18 / 1e-2
    let text = error.to_string();
    let expected = "none of the 2 starts has a finite log marginal likelihood: rounding could move the \
                    log marginal likelihood of 6 samples by 1.3e5 nats, more than 0.1";
    assert!(text.starts_with(expected), "{text}");
}
