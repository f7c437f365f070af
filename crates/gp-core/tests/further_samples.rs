//! Further samples against a refit with all of them, by either path.

use faer::Mat;
use gp_core::{GpError, LikelihoodOptions, Method, Posterior};
use kernels::{TorqueCovariance, TorqueForm};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NOISE_STD: f64 = 0.1;

fn inputs(seed: u64, n: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Mat::from_fn(n, 3, |_, _| rng.random_range(-1.0..1.0))
}

fn torques(x: &Mat<f64>) -> Vec<f64> {
    let torque = |row: usize| 3.0 * x[(row, 0)].sin() + x[(row, 1)].signum() + x[(row, 2)];
    (0..x.nrows()).map(torque).collect()
}

fn posterior(x: &Mat<f64>, method: Method) -> Posterior {
    let options = LikelihoodOptions {
        method,
        certificate: 1e-10,
    };
    let covariance = TorqueCovariance::unit(1, TorqueForm::Coulomb);
    Posterior::new(covariance, NOISE_STD, x.as_ref(), &torques(x), options).unwrap()
}

/// Rows of both, one below the other.
fn joined(first: &Mat<f64>, second: &Mat<f64>) -> Mat<f64> {
    let n = first.nrows();
    Mat::from_fn(n + second.nrows(), 3, |row, col| {
        if row < n {
            first[(row, col)]
        } else {
            second[(row - n, col)]
        }
    })
}

#[test]
fn samples_that_come_later_count_as_if_they_had_been_there() {
    let (old, elsewhere) = (inputs(1, 80), inputs(3, 50));
    // The last of the new states is one of the old, and the one before it comes twice.
    let mut new = inputs(2, 9);
    for col in 0..3 {
        new[(8, col)] = old[(4, col)];
        new[(7, col)] = new[(6, col)];
    }
    let all = joined(&old, &new);
    let covariance = TorqueCovariance::unit(1, TorqueForm::Coulomb);
    let refit = Posterior::dense(covariance, NOISE_STD, all.as_ref(), &torques(&all)).unwrap();
    let expected = refit.predict(elsewhere.as_ref()).unwrap();
    for method in [Method::Dense, Method::Certified] {
        let old = posterior(&old, method);
        let found = old.with_samples(new.as_ref(), &torques(&new)).unwrap();
        let is_dense = !found.basis().is_on_pivots();
        assert_eq!(is_dense, method == Method::Dense);
        // Dense: n |α| K ε with |α| ≤ |t|/σ² and K below 10. Pivots: √(e ε) |α| for traces of 1e-12.
        let tolerance = if is_dense {
            89.0 * 5.0 / NOISE_STD.powi(2) * 10.0 * f64::EPSILON
        } else {
            1e-7
        };
        let prediction = found.predict(elsewhere.as_ref()).unwrap();
        let before = old.predict(elsewhere.as_ref()).unwrap();
        for idx in 0..50 {
            let errors = [
                prediction.mean[idx] - expected.mean[idx],
                prediction.var[idx] - expected.var[idx],
            ];
            assert!(
                errors.iter().all(|error| error.abs() <= tolerance),
                "{is_dense} {errors:?} {tolerance}"
            );
            assert!(prediction.var[idx] <= before.var[idx] + tolerance);
        }
        let mean = found.predict_mean(elsewhere.as_ref()).unwrap();
        assert_eq!(mean, prediction.mean);
    }
}

#[test]
fn samples_that_do_not_fit_are_refused() {
    for method in [Method::Dense, Method::Certified] {
        let old = posterior(&inputs(1, 30), method);
        let x = inputs(2, 4);
        let refused = |x: &Mat<f64>, t: &[f64]| old.with_samples(x.as_ref(), t).unwrap_err();
        let counts = refused(&x, &[1.0; 3]);
        assert!(matches!(counts, GpError::CountMismatch { .. }), "{counts}");
        let nan = refused(&x, &[1.0, f64::NAN, 0.0, 0.0]);
        assert!(
            matches!(nan, GpError::NonFiniteTarget { row: 1, .. }),
            "{nan}"
        );
        let narrow = refused(&Mat::zeros(2, 2), &[1.0; 2]);
        assert!(
            matches!(narrow, GpError::WrongCovariates { .. }),
            "{narrow}"
        );
    }
}

#[test]
fn a_sample_that_comes_k_times_with_k_times_the_variance_counts_once() {
    let (old, new, elsewhere) = (inputs(1, 60), inputs(2, 6), inputs(3, 40));
    let copies = 4;
    let repeated = Mat::from_fn(copies * new.nrows(), 3, |row, col| new[(row / copies, col)]);
    for method in [Method::Dense, Method::Certified] {
        let old = posterior(&old, method);
        let once = old.with_samples(new.as_ref(), &torques(&new)).unwrap();
        let noise_std = NOISE_STD * (copies as f64).sqrt();
        let torques = torques(&repeated);
        let found = old.with_samples_of_noise(repeated.as_ref(), &torques, noise_std);
        let found = found.unwrap();
        assert_eq!(found.noise_std(), NOISE_STD);
        let expected = once.predict(elsewhere.as_ref()).unwrap();
        let predicted = found.predict(elsewhere.as_ref()).unwrap();
        // n |α| K ε: 84 samples, |α| up to |t|/σ² = 2·10³, K below 10; pivots √(e ε) |α| for traces of 10⁻¹².
        let tolerance = 1e-8;
        for (idx, (mean, var)) in predicted.mean.iter().zip(&predicted.var).enumerate() {
            let (mean_once, var_once) = (expected.mean[idx], expected.var[idx]);
            assert!((mean - mean_once).abs() < tolerance, "{mean} {mean_once}");
            assert!((var - var_once).abs() < tolerance, "{var} {var_once}");
        }
    }
    let refused =
        posterior(&old, Method::Dense).with_samples_of_noise(new.as_ref(), &torques(&new), 0.0);
    assert!(
        matches!(refused, Err(GpError::BadNoise { .. })),
        "{refused:?}"
    );
}
