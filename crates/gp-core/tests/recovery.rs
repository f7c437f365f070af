//! Fits to data whose hyperparameters are known.

use faer::Mat;
use gp_core::fit::fit_from;
use gp_core::optimize::StopReason;
use gp_core::search::{Distance, Limits, SearchScheme, Start, refine, search};
use gp_core::{
    Fit, FitOptions, LikelihoodOptions, LogMarginal, Posterior, fit, log_marginal_likelihood,
};
use kernels::{SeArd, TorqueCovariance, TorqueForm, TorqueParams};
use proptest::prelude::*;

use crate::samples::{targets, uniform_inputs};

fn truth(form: TorqueForm) -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 2.0,
        linear_std: vec![3.0, 0.5, 1.0, 0.1, 2.0, 0.3],
        signal_std: 4.0,
        length_scales: vec![3.0, 4.0, 6.0, 10.0, 8.0, 5.0],
        coulomb_std: (form == TorqueForm::Coulomb).then(|| vec![1.5, 0.4]),
    })
    .unwrap()
}

#[test]
fn fit_is_at_least_as_likely_as_the_truth() {
    for (seed, form) in [(1, TorqueForm::Coulomb), (2, TorqueForm::Smooth)] {
        let x = uniform_inputs(seed, 90, 6);
        let t = targets(seed + 50, &truth(form), 0.2, &x);
        let of_truth = log_marginal_likelihood(&truth(form), 0.2, x.as_ref(), &t).unwrap();
        let found = fit(x.as_ref(), &t, form, &FitOptions::several()).unwrap();
        let log_marginal = found.report.log_marginal;
        assert!(
            log_marginal >= of_truth,
            "{form:?}: {log_marginal} below {of_truth}"
        );
        assert!(
            (0.1..0.4).contains(&found.noise_std()),
            "{}",
            found.noise_std()
        );
        assert_eq!(found.report.jitter_added, 0.0);
    }
}

#[test]
fn reported_likelihood_is_that_of_the_fit() {
    let x = uniform_inputs(3, 40, 6);
    let t = targets(53, &truth(TorqueForm::Coulomb), 0.2, &x);
    let found = fit(x.as_ref(), &t, TorqueForm::Coulomb, &FitOptions::several()).unwrap();
    let again =
        log_marginal_likelihood(found.covariance(), found.noise_std(), x.as_ref(), &t).unwrap();
    assert_eq!(found.report.log_marginal, again);
    let winner = found.report.winning_start();
    assert!(
        found
            .report
            .last_stage()
            .starts
            .iter()
            .all(|s| s.log_marginal <= winner.log_marginal)
    );
}

#[test]
fn converged_start_has_a_small_projected_gradient() {
    let x = uniform_inputs(4, 60, 6);
    let t = targets(54, &truth(TorqueForm::Coulomb), 0.2, &x);
    let found = fit(x.as_ref(), &t, TorqueForm::Coulomb, &FitOptions::several()).unwrap();
    for start in &found.report.last_stage().starts {
        match start.stop {
            StopReason::GradientSmall => assert!(start.projected_gradient <= 1e-3),
            // A stall gains less than 1e-5 nats along a direction that descends by
            // |g|²/2κ with curvatures κ up to n/2: |g| ≤ √(1e-5 · 60) = 0.024.
            StopReason::ValueStalled => assert!(start.projected_gradient <= 0.05, "{start:?}"),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn fits_are_bit_identical_from_run_to_run() {
    let x = uniform_inputs(5, 50, 6);
    let t = targets(55, &truth(TorqueForm::Coulomb), 0.2, &x);
    let run = || fit(x.as_ref(), &t, TorqueForm::Coulomb, &FitOptions::several()).unwrap();
    let (first, second) = (run(), run());
    assert_eq!(first.report, second.report);
    assert_eq!(first.covariance(), second.covariance());
}

#[test]
fn noise_free_data_ends_on_the_noise_bound_and_says_so() {
    let x = uniform_inputs(6, 40, 3);
    let t: Vec<f64> = (0..40).map(|row| 3.0 * x[(row, 0)] - x[(row, 1)]).collect();
    let found = fit(x.as_ref(), &t, TorqueForm::Smooth, &FitOptions::chapter()).unwrap();
    assert!(found.report.bounds_hit.contains(&"noise_std".to_owned()));
    // √(1e-4 + eᶻ) stays at the bound, to rounding.
    assert!(found.noise_std().powi(2) >= 1e-4 * (1.0 - 4.0 * f64::EPSILON));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn fit_never_ends_below_its_start(
        seed in 0_u64..1000,
        log_scale in -8.0..8.0_f64,
        max_evaluations in 1_usize..30,
    ) {
        let x = uniform_inputs(seed, 15, 3);
        let scale = log_scale.exp();
        let t: Vec<f64> = (0..15).map(|row| scale * (x[(row, 0)] * 2.0).sin()).collect();
        let options = FitOptions { max_evaluations, ..FitOptions::several() };
        let found = fit(x.as_ref(), &t, TorqueForm::Coulomb, &options).unwrap();
        for start in &found.report.last_stage().starts {
            if let Some(initial) = start.initial_log_marginal {
                prop_assert!(start.log_marginal >= initial, "{start:?}");
            }
            prop_assert!(start.evaluations <= max_evaluations);
        }
    }
}

#[test]
fn search_from_the_optimum_stays_there() {
    let x = uniform_inputs(7, 60, 6);
    let t = targets(57, &truth(TorqueForm::Coulomb), 0.2, &x);
    let options = FitOptions::several();
    let first = fit(x.as_ref(), &t, TorqueForm::Coulomb, &options).unwrap();
    let warm = Start::given(first.covariance().clone(), first.noise_std());
    let second = fit_from(x.as_ref(), &t, &[warm], &options).unwrap();
    let gain = second.report.log_marginal - first.report.log_marginal;
    // The round trip through the unconstrained coordinates rounds θ by a few ε.
    assert!(gain >= -1e-9, "{gain}");
    assert!(second.report.evaluations() < first.report.evaluations());
}

#[test]
fn any_covariance_is_searched_from_one_start() {
    let x = uniform_inputs(8, 60, 3);
    let truth = SeArd::new(3.0, vec![1.0, 4.0, 2.0]).unwrap();
    let t = targets(58, &truth, 0.2, &x);
    let of_truth = log_marginal_likelihood(&truth, 0.2, x.as_ref(), &t).unwrap();

    let options = FitOptions::chapter();
    let start = SeArd::new(1.0, vec![1.0; 3]).unwrap();
    let mut evidence = LogMarginal::new(x.as_ref(), &t, options.likelihood);
    let end = search(&mut evidence, &Start::given(start, 1.0), &options.limits());
    assert!(
        end.report.log_marginal >= of_truth,
        "{:?} below {of_truth}",
        end.report
    );
    let posterior = Posterior::new(
        end.covariance,
        end.noise_std,
        x.as_ref(),
        &t,
        options.likelihood,
    );
    let means = posterior.unwrap().predict_mean(x.as_ref()).unwrap();
    // Residuals at the training points are below σ on average.
    let residual: f64 = (means.iter().zip(&t)).map(|(m, t)| (m - t).powi(2)).sum();
    assert!(residual <= 60.0 * end.noise_std.powi(2), "{residual}");
}

fn nested_and_whole(n: usize) -> (Fit, Fit) {
    let x = uniform_inputs(9, n, 3);
    let t = targets(59, &truth_of_one_joint(), 0.2, &x);
    let fit_with = |scheme| {
        let options = FitOptions {
            scheme,
            ..FitOptions::several()
        };
        fit(x.as_ref(), &t, TorqueForm::Coulomb, &options).unwrap()
    };
    (
        fit_with(SearchScheme::Nested),
        fit_with(SearchScheme::Whole),
    )
}

fn truth_of_one_joint() -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 2.0,
        linear_std: vec![3.0, 0.5, 1.0],
        signal_std: 4.0,
        length_scales: vec![1.5, 2.0, 6.0],
        coulomb_std: Some(vec![1.5]),
    })
    .unwrap()
}

#[test]
fn nested_search_ends_as_high_as_the_search_on_all_samples() {
    let (nested, whole) = nested_and_whole(600);
    let sizes: Vec<usize> = (nested.report.stages.iter().map(|s| s.n_samples)).collect();
    assert_eq!(sizes, [150, 300, 600]);
    assert_eq!(nested.report.stages[0].starts.len(), 4);
    let (nested, whole) = (nested.report.log_marginal, whole.report.log_marginal);
    // One basin, found to 1e-5 nats an iteration by both.
    assert!(nested >= whole - 0.01, "{nested} below {whole}");
}

#[test]
fn few_samples_are_searched_whole_by_either_scheme() {
    let (nested, whole) = nested_and_whole(60);
    assert_eq!(nested.report, whole.report);
}

#[test]
fn work_limit_ends_a_search_and_says_so() {
    let x = uniform_inputs(10, 60, 3);
    let t = targets(60, &truth_of_one_joint(), 0.2, &x);
    let options = FitOptions {
        max_work: 5.0,
        ..FitOptions::several()
    };
    let found = fit(x.as_ref(), &t, TorqueForm::Coulomb, &options).unwrap();
    for start in &found.report.last_stage().starts {
        // 60 samples are searched by the dense path, one unit of work an evaluation.
        assert_eq!((start.evaluations, start.work), (5, 5.0), "{start:?}");
        assert_eq!(start.stop, StopReason::WorkLimit);
    }
}

fn short(max_evaluations: usize) -> Limits {
    (FitOptions::chapter().limits()).with_evaluations(max_evaluations)
}

#[test]
fn faded_length_scales_come_back_when_a_search_is_refined() {
    let x = uniform_inputs(11, 80, 3);
    let truth = TorqueCovariance::new(TorqueParams {
        bias_std: 1e-3,
        linear_std: vec![1e-3; 3],
        signal_std: 3.0,
        length_scales: vec![1.0, 1.5, 2.0],
        coulomb_std: None,
    })
    .unwrap();
    let t = targets(61, &truth, 0.1, &x);
    let of_truth = log_marginal_likelihood(&truth, 0.1, x.as_ref(), &t).unwrap();
    // The second covariate is taken for superfluous, so surely that nothing points back.
    let mut faded = truth.named_params();
    faded.length_scales[1] = 1e9;
    let faded = TorqueCovariance::new(faded).unwrap();
    let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
    let mut end = search(&mut evidence, &Start::given(faded, 0.1), &short(200));
    assert!(
        end.report.log_marginal < of_truth - 10.0,
        "{:?}",
        end.report
    );
    assert!(end.covariance.se().length_scales()[1] > 1e8);
    refine(&mut evidence, &mut end, &short(200));
    assert!(end.report.log_marginal >= of_truth, "{:?}", end.report);
    assert!(end.covariance.se().length_scales()[1] < 10.0);
}

#[test]
fn narrow_valley_is_followed_to_its_end_in_the_metric_of_the_information() {
    // σ is a thousandth of the signal, so that the likelihood is a valley a thousand times longer than wide.
    let x = uniform_inputs(12, 60, 6);
    let t = targets(62, &truth(TorqueForm::Smooth), 0.01, &x);
    let start = Start::given(TorqueCovariance::unit(2, TorqueForm::Smooth), 1.0);
    let end_of = |plain: usize, refined: usize| {
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let mut end = search(&mut evidence, &start, &short(plain));
        refine(&mut evidence, &mut end, &short(refined));
        end.report
    };
    let refined = end_of(60, 240);
    let longer = end_of(60, 2000);
    assert!(
        longer.log_marginal - refined.log_marginal < 0.1,
        "{refined:?} {longer:?}"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn refinement_never_lowers_the_likelihood_nor_exceeds_its_limits(
        seed in 0_u64..1000,
        plain in 1_usize..20,
        refined in 1_usize..40,
    ) {
        let x = uniform_inputs(seed, 20, 3);
        let t: Vec<f64> = (0..20).map(|row| (x[(row, 0)] * 2.0).sin() + x[(row, 2)]).collect();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let start = Start::given(TorqueCovariance::unit(1, TorqueForm::Coulomb), 0.5);
        let mut end = search(&mut evidence, &start, &short(plain));
        let before = end.report.clone();
        refine(&mut evidence, &mut end, &short(refined));
        prop_assert!(end.report.log_marginal >= before.log_marginal);
        prop_assert!(end.report.evaluations <= before.evaluations + refined);
        let again = log_marginal_likelihood(&end.covariance, end.noise_std, x.as_ref(), &t);
        let error = (again.unwrap() - end.report.log_marginal).abs();
        prop_assert!(error <= 1e-6 * end.report.log_marginal.abs().max(1.0), "{error}");
    }
}

#[test]
fn a_start_too_sure_for_more_samples_is_entered_with_more_noise() {
    let x = Mat::from_fn(40, 1, |row, _| 0.25 * row as f64);
    let t: Vec<f64> = (0..40).map(|row| (0.25 * f64::from(row)).sin()).collect();
    let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::dense());
    // n ε v²/σ² = 40 · 2.2e-16 · 1e10 / 1e-4 = 0.9 nats of rounding; a tenth is the limit.
    let covariance = SeArd::new(1e5, vec![3.0]).unwrap();
    let start = Start::given(covariance, 0.01).at(Distance::Near);
    let end = search(&mut evidence, &start, &short(60));
    assert!(end.report.log_marginal.is_finite(), "{:?}", end.report);
    let started = end.report.initial_log_marginal.unwrap();
    assert!(end.report.log_marginal >= started);
}
