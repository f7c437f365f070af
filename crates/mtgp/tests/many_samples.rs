//! iGP and pGP beyond the number of samples that a dense matrix takes: they find the noise that was put in.

use faer::Mat;
use gp_core::evidence::evidence;
use gp_core::{LikelihoodOptions, Method, MethodUsed};
use mtgp::{MultiTaskOptions, Stacked, TaskFit, fit_independent, fit_pooled};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Just beyond 16,384.
const N: usize = 16_400;
const NOISE_STD: f64 = 0.05;
const OFFSET: f64 = 0.3;

/// A smooth torque of one joint in two tasks, which differ by a constant.
fn two_tasks() -> (Stacked, Vec<f64>) {
    let mut rng = ChaCha8Rng::seed_from_u64(56);
    let x: Mat<f64> = Mat::from_fn(N, 3, |_, _| rng.random_range(-1.0..1.0));
    let tasks: Vec<usize> = (0..N).map(|row| row % 2).collect();
    let torque = |row: usize| {
        let offset = if tasks[row] == 0 { OFFSET } else { -OFFSET };
        // Uniform, of standard deviation one.
        let noise = rng.random_range(-1.0..1.0) * 3.0_f64.sqrt();
        2.0 * x[(row, 0)] + x[(row, 1)].sin() + 0.5 * x[(row, 2)] + offset + NOISE_STD * noise
    };
    let torques: Vec<f64> = (0..N).map(torque).collect();
    let data = Stacked::new(x.as_ref(), &tasks, 2).unwrap();
    let targets = data.stack(&torques);
    (data, targets)
}

fn options() -> MultiTaskOptions {
    MultiTaskOptions {
        screening: 10,
        max_evaluations: 40,
        ..MultiTaskOptions::several()
    }
}

/// Five standard errors 1/√(2n) of a standard deviation.
fn assert_close(found: f64, expected: f64) {
    let tolerance = 5.0 / (2.0 * N as f64).sqrt() * expected;
    assert!((found - expected).abs() <= tolerance, "{found} {expected}");
}

fn assert_low_rank(fit: &TaskFit) {
    assert_eq!(fit.report.method, MethodUsed::Certified);
    assert_eq!(
        fit.report.last_stage().starts.len(),
        1,
        "the end on a part of the samples"
    );
}

#[test]
fn independent_tasks_have_the_noise_of_the_data_and_a_likelihood_each() {
    let (data, targets) = two_tasks();
    let fit = fit_independent(&data, &targets, &options()).unwrap();
    assert_low_rank(&fit);
    assert_close(fit.noise_std(), NOISE_STD);

    let tight = LikelihoodOptions {
        method: Method::Certified,
        certificate: 1e-6,
    };
    let (mut sum, mut bound) = (0.0, fit.report.error_bound);
    for task in 0..2 {
        let (first, count) = (task * N / 2, N / 2);
        let x = data.covariates().subrows(first, count);
        let t = &targets[first..first + count];
        let of_task = evidence(fit.covariance().input(), fit.noise_std(), x, t, tight);
        let evaluation = of_task.unwrap().evaluation;
        sum += evaluation.log_marginal_likelihood;
        bound += evaluation.error_bound;
    }
    let difference = fit.log_marginal() - sum;
    assert!(difference.abs() <= bound, "{difference:e} {bound:e}");
}

#[test]
fn pooled_tasks_take_what_they_differ_by_for_noise() {
    let (data, targets) = two_tasks();
    let fit = fit_pooled(&data, &targets, &options()).unwrap();
    assert_low_rank(&fit);
    assert_close(fit.noise_std(), OFFSET.hypot(NOISE_STD));
}
