//! Noise per task: against 50-digit arithmetic, central differences, and the shared noise.

use gp_core::evidence::log_marginal_likelihood_with_gradient;
use gp_core::{LikelihoodOptions, Method};
use kernels::Covariance;
use mtgp::prior::TaskNoise;
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance};

use crate::fixture::{Case, M, case};

fn model(case: &Case) -> TaskNoise {
    TaskNoise::new(case.covariance.clone(), case.noise_std.clone()).unwrap()
}

fn options(method: Method) -> LikelihoodOptions {
    LikelihoodOptions {
        method,
        certificate: 1e-9,
    }
}

#[test]
fn value_and_gradient_are_those_of_fifty_digits() {
    let case = case("noises");
    let data = case.stacked();
    let targets = data.stack(&case.torques);
    for method in [Method::Dense, Method::Certified] {
        let found = model(&case)
            .evidence(&data, &targets, options(method))
            .unwrap();
        let (value, expected) = (
            found.evaluation.log_marginal_likelihood,
            case.expected[0].value,
        );
        let error = (value - expected).abs() / expected.abs();
        assert!(error <= 1e-10, "{method:?}: {value} {expected} {error:e}");
        assert_eq!(found.gradient.len(), case.expected.len() - 1);
        for (entry, row) in found.gradient.iter().zip(&case.expected[1..]) {
            let error = (entry - row.value).abs() / row.value.abs();
            assert!(
                error <= 1e-8,
                "{method:?} {}: {entry} {} {error:e}",
                row.name,
                row.value
            );
        }
    }
}

#[test]
fn equal_noises_are_the_shared_noise() {
    let five = case("five");
    let data = five.stacked();
    let targets = data.stack(&five.torques);
    let noise_std = five.noise_std[0];
    for task in [
        five.covariance.task().clone(),
        TaskCovariance::Identity { n_tasks: M },
        TaskCovariance::Ones { n_tasks: M },
    ] {
        let prior = MultiTaskCovariance::new(five.covariance.input().clone(), task);
        let (value, slopes) =
            log_marginal_likelihood_with_gradient(&prior, noise_std, data.inputs(), &targets)
                .unwrap();
        let each = TaskNoise::new(prior.clone(), vec![noise_std; M]).unwrap();
        let found = each
            .evidence(&data, &targets, options(Method::Dense))
            .unwrap();
        let error = (found.evaluation.log_marginal_likelihood - value).abs();
        assert!(error <= 1e-10 * value.abs(), "{value} {error:e}");
        let n_prior = prior.n_params();
        for (a, b) in found.gradient[..n_prior].iter().zip(&slopes) {
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{a} {b}");
        }
        let sum: f64 = found.gradient[n_prior..].iter().sum();
        let shared = slopes[n_prior];
        assert!(
            (sum - shared).abs() <= 1e-9 * shared.abs(),
            "{sum} {shared}"
        );
    }
}

#[test]
fn noise_slopes_of_the_fixed_kinds_are_central_differences() {
    let case = case("noises");
    let data = case.stacked();
    let targets = data.stack(&case.torques);
    for task in [
        TaskCovariance::Identity { n_tasks: M },
        TaskCovariance::Ones { n_tasks: M },
    ] {
        let prior = MultiTaskCovariance::new(case.covariance.input().clone(), task);
        let at = |noises: &[f64]| {
            let model = TaskNoise::new(prior.clone(), noises.to_vec()).unwrap();
            model
                .evidence(&data, &targets, options(Method::Dense))
                .unwrap()
        };
        let found = at(&case.noise_std);
        let slopes = &found.gradient[prior.n_params()..];
        assert_eq!(slopes.len(), M);
        for (idx, noise_std) in case.noise_std.iter().enumerate() {
            let step = 1e-5 * noise_std;
            let value = |shift: f64| {
                let mut moved = case.noise_std.clone();
                moved[idx] += shift;
                at(&moved).evaluation.log_marginal_likelihood
            };
            let difference = (value(step) - value(-step)) / (2.0 * step);
            let error = (slopes[idx] - difference).abs();
            // Values up to 1e4 rounded to 1e-10 of themselves over a step of 5e-7, and a third
            // derivative of up to 24 v/σ³ times step²/6.
            let size = found.evaluation.log_marginal_likelihood.abs();
            let tolerance = size * (1e-13 / step + 4e-10 / noise_std);
            assert!(
                error <= tolerance,
                "{idx}: {} {difference} {tolerance:e}",
                slopes[idx]
            );
        }
    }
}

#[test]
fn noises_and_data_that_do_not_fit_are_refused() {
    let case = case("noises");
    let short = TaskNoise::new(case.covariance.clone(), vec![0.1; 4]).unwrap_err();
    assert_eq!(
        short.to_string(),
        "4 noise standard deviations of tasks, expected 5"
    );
    let zero = TaskNoise::new(case.covariance.clone(), vec![0.1, 0.2, 0.0, 0.1, 0.1]);
    assert_eq!(
        zero.unwrap_err().to_string(),
        "task_noise_std[2] is 0, but must be finite and greater than zero"
    );
    let data = case.stacked();
    let evidence = |targets: &[f64]| {
        model(&case)
            .evidence(&data, targets, options(Method::Dense))
            .unwrap_err()
    };
    assert_eq!(evidence(&[1.0]).to_string(), "1 targets, expected 24");
    let mut targets = case.torques.clone();
    targets[7] = f64::NAN;
    assert!(matches!(
        evidence(&targets),
        MtgpError::NonFinite { row: 7, .. }
    ));
}
