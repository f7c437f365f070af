//! The low-rank path: its value within its bound, its gradient, its repeatability.

use faer::Mat;
use gp_core::evidence::{Evidence, evidence};
use gp_core::{LikelihoodOptions, LogMarginal, Method, MethodUsed};
use kernels::{Covariance, TorqueCovariance};
use proptest::prelude::*;

use crate::curves;
use crate::fixture::{case, conditioning_error, likelihood_rows};

fn certified(certificate: f64) -> LikelihoodOptions {
    LikelihoodOptions {
        method: Method::Certified,
        certificate,
    }
}

fn both(
    covariance: &TorqueCovariance,
    noise_std: f64,
    x: &Mat<f64>,
    certificate: f64,
) -> (Evidence, Evidence) {
    let targets = curves::targets(x);
    let run = |options| evidence(covariance, noise_std, x.as_ref(), &targets, options).unwrap();
    (run(certified(certificate)), run(LikelihoodOptions::dense()))
}

/// Checks the low-rank path against 50 digits.
fn check_fixture(name: &str, certificate: f64, gradient_tolerance: f64) {
    let case = case(name);
    let expected = likelihood_rows(name);
    let found = evidence(
        &case.covariance,
        case.noise_std,
        case.x.as_ref(),
        &case.targets,
        certified(certificate),
    )
    .unwrap();
    let evaluation = found.evaluation;
    let error = (evaluation.log_marginal_likelihood - expected[0].2).abs();
    assert!(
        error <= evaluation.error_bound,
        "{name}: {error:e} {evaluation:?}"
    );
    let largest = expected[1..]
        .iter()
        .fold(0.0, |l: f64, row| l.max(row.2.abs()));
    for (entry, row) in found.gradient.iter().zip(&expected[1..]) {
        let error = (entry - row.2).abs() / largest;
        assert!(
            error <= gradient_tolerance,
            "{name} {}: {entry} {} error {error:e}",
            row.0,
            row.2
        );
    }
}

#[test]
fn value_is_within_its_bound_of_fifty_digits() {
    // At full rank nothing is left out: only rounding remains.
    check_fixture("well", 1e-9, 1e-12);
    check_fixture("smooth", 1e-9, 1e-12);
    check_fixture("ill", 1e-6, conditioning_error(&case("ill")));
}

#[test]
fn truncated_value_is_within_its_bound_of_fifty_digits() {
    // Of 60 pivots, 37 to 56 are taken. The gradient is that of the truncated value: a
    // change by the certificate over σ = 0.01, relative to a largest entry near 600.
    for certificate in [0.3, 1e-2, 1e-4] {
        check_fixture("curve", certificate, certificate / 6.0);
    }
}

#[test]
fn low_rank_value_and_gradient_are_those_of_the_dense_path() {
    let x = curves::inputs(400);
    for certificate in [1e-2, 1e-4, 1e-6] {
        let (low, dense) = both(&curves::covariance(2.0), 0.03, &x, certificate);
        assert_eq!(low.evaluation.method, MethodUsed::Certified);
        assert!(low.evaluation.rank < 200, "{:?}", low.evaluation);
        let difference =
            low.evaluation.log_marginal_likelihood - dense.evaluation.log_marginal_likelihood;
        let bound = low.evaluation.error_bound + dense.evaluation.error_bound;
        assert!(difference.abs() <= bound, "{difference:e} {bound:e}");
        // What rounding may hide comes on top, here 3e-5.
        assert!(bound <= 2.0 * certificate + 1e-4, "{bound:e}");
        let largest = dense.gradient.iter().fold(0.0, |l: f64, g| l.max(g.abs()));
        for (idx, (a, b)) in low.gradient.iter().zip(&dense.gradient).enumerate() {
            // A change of the value by the certificate over a relative change of θ by one
            // or so: a hundred certificates leave room for the decay of the spectrum.
            let theta = curves::covariance(2.0).params().get(idx).copied();
            let tolerance = 100.0 * certificate / theta.unwrap_or(0.03) + 1e-9 * largest;
            assert!((a - b).abs() <= tolerance, "{idx}: {a} {b} {tolerance:e}");
        }
    }
}

#[test]
fn where_there_is_no_dense_path_the_automatic_choice_leaves_more_out() {
    let x = curves::inputs(16_400);
    let (covariance, targets) = (curves::covariance(2.0), curves::targets(&x));
    let run = |options| {
        let found = evidence(&covariance, 0.03, x.as_ref(), &targets, options);
        found.unwrap().evaluation
    };
    let (automatic, tight) = (run(LikelihoodOptions::automatic()), run(certified(1e-4)));
    assert_eq!(automatic.method, MethodUsed::Certified);
    assert!(automatic.rank < tight.rank, "{automatic:?} {tight:?}");
    let difference = automatic.log_marginal_likelihood - tight.log_marginal_likelihood;
    let bound = automatic.error_bound + tight.error_bound;
    assert!(difference.abs() <= bound, "{difference:e} {bound:e}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn bound_holds_over_hyperparameters(
        logs in prop::collection::vec(-1.5..1.5_f64, 44),
        log_noise in -4.6..0.5_f64,
        log_certificate in -14.0..1.0_f64,
        stretch in 0.5..4.0_f64,
    ) {
        let x = curves::inputs(150);
        let mut covariance = curves::covariance(stretch);
        let theta: Vec<f64> = (covariance.params().iter().zip(&logs))
            .map(|(value, log)| value * log.exp())
            .collect();
        covariance.set_params(&theta);
        let (low, dense) = both(&covariance, log_noise.exp(), &x, log_certificate.exp());
        let difference =
            low.evaluation.log_marginal_likelihood - dense.evaluation.log_marginal_likelihood;
        let bound = low.evaluation.error_bound + dense.evaluation.error_bound;
        prop_assert!(difference.abs() <= bound, "{difference:e} {:?}", low.evaluation);
    }
}

#[test]
fn pivots_of_the_evaluation_before_change_the_value_within_its_bound() {
    let x = curves::inputs(500);
    let targets = curves::targets(&x);
    let mut marginal = LogMarginal::new(x.as_ref(), &targets, certified(1e-4));
    for stretch in [2.0, 2.02, 1.6, 3.0, 1.0, 2.0] {
        let covariance = curves::covariance(stretch);
        let mut gradient = vec![0.0; covariance.n_params() + 1];
        let warm = (marginal.evaluate(&covariance, 0.03, &mut gradient)).unwrap();
        let (_, dense) = both(&covariance, 0.03, &x, 1.0);
        let difference = warm.log_marginal_likelihood - dense.evaluation.log_marginal_likelihood;
        let bound = warm.error_bound + dense.evaluation.error_bound;
        assert!(
            difference.abs() <= bound,
            "{stretch}: {difference:e} {bound:e}"
        );
        assert!(bound <= 3e-4, "{stretch}: {bound:e}");
    }
}

#[test]
fn pivots_sought_among_a_part_of_the_samples_are_enough_for_all() {
    // More samples than are searched, the two curves sample by sample and one after the other.
    let x = curves::inputs(1800);
    let sorted = Mat::from_fn(1800, 18, |row, col| x[(2 * (row % 900) + row / 900, col)]);
    for x in [x, sorted] {
        let (low, dense) = both(&curves::covariance(4.0), 0.03, &x, 1e-2);
        let (low, dense) = (low.evaluation, dense.evaluation);
        let difference = low.log_marginal_likelihood - dense.log_marginal_likelihood;
        assert!(difference.abs() <= low.error_bound + dense.error_bound);
        // What rounding may hide comes on top of the certificate, here 5e-4.
        assert!(low.error_bound <= 1.1e-2, "{low:?}");
        assert!(low.rank <= 100, "{low:?}");
    }
}

#[test]
fn automatic_choice_is_dense_where_the_rank_does_not_pay() {
    let automatic = |x: &Mat<f64>, stretch: f64| {
        let options = LikelihoodOptions::automatic();
        let targets = curves::targets(x);
        let covariance = curves::covariance(stretch);
        let found = evidence(&covariance, 0.03, x.as_ref(), &targets, options).unwrap();
        found.evaluation
    };
    let x = curves::inputs(400);
    assert_eq!(automatic(&x, 8.0).method, MethodUsed::Certified);
    // Short length scales: every sample is new.
    let rough = automatic(&x, 0.02);
    assert_eq!((rough.method, rough.rank), (MethodUsed::Dense, 400));
    let few = x.subrows(0, 40).to_owned();
    assert_eq!(automatic(&few, 8.0).method, MethodUsed::Dense);
}

#[test]
fn low_rank_path_can_be_forced_up_to_full_rank() {
    let x = curves::inputs(60);
    let (low, dense) = both(&curves::covariance(0.02), 0.03, &x, 1e-6);
    assert_eq!(low.evaluation.method, MethodUsed::Certified);
    let difference =
        low.evaluation.log_marginal_likelihood - dense.evaluation.log_marginal_likelihood;
    assert!(difference.abs() <= low.evaluation.error_bound + dense.evaluation.error_bound);
}

#[test]
fn low_rank_path_is_bit_identical_from_run_to_run() {
    let x = curves::inputs(300);
    let run = || both(&curves::covariance(2.0), 0.03, &x, 1e-4).0;
    assert_eq!(run(), run());
}
