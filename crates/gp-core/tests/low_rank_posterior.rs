//! Predictions from a few pivots are those of the whole matrix.

use faer::Mat;
use gp_core::{FitOptions, GpError, LikelihoodOptions, Method, Posterior, fit};
use kernels::TorqueForm;

use crate::curves;

const NOISE_STD: f64 = 0.03;

fn low_rank(x: &Mat<f64>, certificate: f64) -> Posterior {
    let options = LikelihoodOptions {
        method: Method::Certified,
        certificate,
    };
    let targets = curves::targets(x);
    let covariance = curves::covariance(4.0);
    let posterior = Posterior::new(covariance, NOISE_STD, x.as_ref(), &targets, options).unwrap();
    assert!(posterior.basis().is_on_pivots());
    posterior
}

/// Points on the curves, beside them, and far away.
fn points() -> Mat<f64> {
    let on_curves = curves::inputs(700);
    Mat::from_fn(300, 18, |row, col| {
        let shift = [0.0, 0.05, 3.0][row % 3];
        on_curves[(400 + row, col)] + shift * (col as f64).cos()
    })
}

#[test]
fn mean_and_variance_are_those_of_the_dense_posterior() {
    let x = curves::inputs(400);
    let targets = curves::targets(&x);
    let dense = Posterior::dense(curves::covariance(4.0), NOISE_STD, x.as_ref(), &targets).unwrap();
    let expected = dense.predict(points().as_ref()).unwrap();
    let found = low_rank(&x, 1e-4);
    assert!(found.rank() < 100, "{}", found.rank());
    let prediction = found.predict(points().as_ref()).unwrap();

    for idx in 0..300 {
        // The bound in the documentation with ε|α|² ≤ 2e-4 is √(e ε)|α| = 0.014 √e,
        // and √e is at most the latent standard deviation.
        let (mean, std) = (expected.mean[idx], expected.var[idx].sqrt());
        let error = (prediction.mean[idx] - mean).abs();
        assert!(
            error <= 0.014 * std + 1e-6,
            "{idx}: mean {mean} {error:e} {std}"
        );
        let error = (prediction.var[idx] - expected.var[idx]).abs();
        assert!(
            error <= 0.01 * expected.var[idx] + 1e-9,
            "{idx}: var {} {error:e}",
            expected.var[idx]
        );
    }
    let means = found.predict_mean(points().as_ref()).unwrap();
    assert_eq!(means, prediction.mean);
}

#[test]
fn posterior_survives_being_taken_apart() {
    let x = curves::inputs(200);
    let found = low_rank(&x, 1e-4);
    let again = Posterior::from_parts(found.covariance().clone(), NOISE_STD, found.basis().clone());
    let again = again.unwrap().predict(points().as_ref()).unwrap();
    assert_eq!(again, found.predict(points().as_ref()).unwrap());
}

#[test]
fn parts_that_do_not_fit_together_are_errors() {
    let found = low_rank(&curves::inputs(200), 1e-4);
    let rebuild = |change: &dyn Fn(&mut gp_core::Basis, &mut f64)| {
        let (mut basis, mut noise_std) = (found.basis().clone(), NOISE_STD);
        change(&mut basis, &mut noise_std);
        Posterior::from_parts(found.covariance().clone(), noise_std, basis).unwrap_err()
    };
    let rank = found.rank();
    let short = rebuild(&|basis, _| basis.weights.truncate(rank - 1));
    assert!(matches!(short, GpError::CountMismatch { .. }));
    let noise = rebuild(&|_, noise_std| *noise_std = 0.0);
    assert!(matches!(noise, GpError::BadNoise { .. }));
    let weight = rebuild(&|basis, _| basis.weights[3] = f64::NAN);
    assert!(matches!(weight, GpError::NonFiniteTarget { row: 3, .. }));
    let factor = rebuild(&|basis, _| basis.noise_factor.as_mut().unwrap()[(1, 2)] = f64::INFINITY);
    assert!(matches!(
        factor,
        GpError::NonFiniteInput {
            row: 1,
            column: 2,
            ..
        }
    ));
}

#[test]
fn fit_by_the_low_rank_path_reports_it_and_predicts() {
    let x = curves::inputs(600);
    let targets = curves::targets(&x);
    let options = FitOptions {
        max_evaluations: 25,
        ..FitOptions::several()
    };
    let found = fit(x.as_ref(), &targets, TorqueForm::Coulomb, &options).unwrap();
    let report = &found.report;
    assert_eq!(report.method, gp_core::MethodUsed::Certified);
    assert_eq!(report.rank, found.posterior.rank());
    assert!(report.rank < 120 && report.error_bound < 0.1, "{report:?}");
    let value = gp_core::log_marginal_likelihood(
        found.covariance(),
        found.noise_std(),
        x.as_ref(),
        &targets,
    );
    let error = (value.unwrap() - report.log_marginal).abs();
    assert!(error <= 2.0 * report.error_bound, "{error:e} {report:?}");
}

#[test]
fn a_dense_posterior_goes_on_pivots() {
    let x = curves::inputs(400);
    let conditioned = |scale: f64| {
        let options = LikelihoodOptions::dense();
        let targets = curves::targets(&x);
        Posterior::new(
            curves::covariance(scale),
            NOISE_STD,
            x.as_ref(),
            &targets,
            options,
        )
        .unwrap()
    };
    let moved = conditioned(4.0).on_pivots(1e-4).unwrap();
    assert!(
        moved.basis().is_on_pivots(),
        "a smooth covariance needs few pivots"
    );
    let direct = low_rank(&x, 1e-4);
    assert_eq!(moved.basis().points, direct.basis().points);
    // The targets come back from the factor to some n ε of K, far below a mean's 1e-7.
    let found = moved.predict(points().as_ref()).unwrap();
    let expected = direct.predict(points().as_ref()).unwrap();
    for (found, expected) in found.mean.iter().zip(&expected.mean) {
        assert!((found - expected).abs() < 1e-7, "{found} {expected}");
    }
    assert_eq!(found.var, expected.var);

    // Length scales of a fiftieth leave every sample alone.
    let rough = conditioned(0.02).on_pivots(1e-4).unwrap();
    assert_eq!(rough.rank(), 400);
}
