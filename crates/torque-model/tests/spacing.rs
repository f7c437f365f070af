//! Rows of a log that are near each other in time: which of them are learned from, and how many count as one.

use std::f64::consts::TAU;

use faer::Mat;
use gp_core::{BayesLinear, LinearForm};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::learn::{Learn, Linear};
use torque_model::rigid_body::LEAST_SECONDS;
use torque_model::{
    JointModel, JointTorques, ProcessRows, RobotModel, Samples, Timeline, TorqueError,
    residual_correlation,
};

use crate::torque_models::{N_JOINTS, names, provenance, uniform_inputs};

/// q, q̇, q̈ of two joints at a time.
fn state(t: f64) -> [f64; 6] {
    let (a, b) = (TAU * 0.23, TAU * 0.41);
    let (c, d) = (TAU * 0.31, TAU * 0.17);
    [
        (a * t).sin() + 0.5 * (b * t).cos(),
        0.8 * (c * t).sin() + 0.6 * (d * t).sin(),
        a * (a * t).cos() - 0.5 * b * (b * t).sin(),
        0.8 * c * (c * t).cos() + 0.6 * d * (d * t).cos(),
        -a * a * (a * t).sin() - 0.5 * b * b * (b * t).cos(),
        -0.8 * c * c * (c * t).sin() - 0.6 * d * d * (d * t).sin(),
    ]
}

/// A log of two joints at some times, without torques.
fn log(t: &[f64]) -> Samples {
    let states: Vec<[f64; 6]> = t.iter().map(|t| state(*t)).collect();
    let x = Mat::from_fn(t.len(), 6, |row, col| states[row][col]);
    let names = vec!["shoulder".to_owned(), "elbow".to_owned()];
    let samples = Samples::of_one_context(names, x, Vec::new()).unwrap();
    Samples {
        timeline: Timeline {
            t: t.to_vec(),
            ..Timeline::default()
        },
        ..samples
    }
}

fn evenly(n: usize, step: f64) -> Vec<f64> {
    (0..n).map(|row| row as f64 * step).collect()
}

#[test]
fn rows_are_taken_as_far_apart_as_they_are_asked_for_in_every_run() {
    // 0.1 · 3 is more than 0.3, 0.7 − 0.4 less: rounding takes nothing away.
    let apart = |t: &[f64]| log(t).rows_apart(0.3).unwrap();
    assert_eq!(apart(&evenly(10, 0.1)), [0, 3, 6, 9]);
    assert_eq!(apart(&[0.4, 0.5, 0.7, 0.8, 1.0]), [0, 2, 4]);
    // Uneven steps: from the last one taken.
    assert_eq!(apart(&[0.0, 0.25, 0.5, 0.75, 2.0]), [0, 2, 4]);
    // Time that falls begins a run.
    assert_eq!(apart(&[0.0, 0.2, 0.4, 0.0, 0.2]), [0, 2, 3]);

    let mut runs = log(&[0.0, 0.0, 0.1, 0.2, 0.3, 0.4]);
    runs.timeline.run_of = vec![0, 1, 0, 1, 0, 1];
    runs.timeline.run_names = vec!["a".to_owned(), "b".to_owned()];
    assert_eq!(runs.rows_apart(0.3).unwrap(), [0, 1, 4, 5]);
    let thinned = runs.thinned(0.3).unwrap();
    assert_eq!(thinned.timeline.t, [0.0, 0.0, 0.3, 0.4]);
    assert_eq!(thinned.timeline.run_of, [0, 1, 0, 1]);
    assert_eq!(thinned.x.row(3), runs.x.row(5));

    let still = log(&[0.0, 0.0]).rows_apart(0.3);
    assert!(matches!(still, Err(TorqueError::Log { .. })), "{still:?}");
    let mut timeless = log(&evenly(5, 0.01));
    timeless.timeline = Timeline::default();
    assert_eq!(timeless.rows_apart(0.3).unwrap(), [0, 1, 2, 3, 4]);
}

#[test]
fn a_process_learns_from_rows_apart_where_they_are_ten_for_each_covariate() {
    let rows_of = |n, step| log(&evenly(n, step)).process_rows().unwrap();
    assert_eq!(rows_of(100, 0.3), ProcessRows::All);
    // 6 covariates: 60 rows. 592 rows 0.03 s apart: the first and every tenth one, 60.
    let every_tenth: Vec<usize> = (0..600).step_by(10).collect();
    assert_eq!(rows_of(600, 0.03), ProcessRows::Apart(every_tenth));
    let too_few = ProcessRows::TooFewApart {
        found: 59,
        needed: 60,
    };
    assert_eq!(rows_of(590, 0.03), too_few);
}

#[test]
fn rows_that_count_as_one_by_hand() {
    let count = |t: &[f64]| log(t).rows_per_independent(0.3).unwrap();
    // 0.3 s in steps of 0.03 s.
    assert!((count(&evenly(31, 0.03)) - 10.0).abs() < 1e-12);
    assert_eq!(count(&evenly(5, 2.0)), 1.0);
    // Not less than one row for a run: five of them count as one, and not as 5 · 0.01/0.3.
    assert_eq!(count(&evenly(5, 0.01)), 5.0);
    assert_eq!(count(&[3.0]), 1.0);
    // Runs of 31 rows at 0.03 s, 3.1 independent ones, and of 2 at 1 s.
    let two = [evenly(31, 0.03), evenly(2, 1.0)].concat();
    assert!((count(&two) - 33.0 / 5.1).abs() < 1e-12, "{}", count(&two));
}

#[test]
fn states_tell_how_far_apart_they_are_if_they_follow_each_other() {
    // Simpson's error of the mean speed over a step is (ωΔt)²/12 of it at most: 1 % at 0.12 s and 0.41 Hz.
    for step in [0.001, 0.01, 0.12] {
        let found = log(&evenly(300, step)).apparent_step().unwrap();
        assert!((found / step - 1.0).abs() < 0.02, "{found} {step}");
    }
    // Several runs, one after another.
    let runs = [evenly(50, 0.01), evenly(40, 0.01), evenly(60, 0.01)].concat();
    let found = log(&runs).apparent_step().unwrap();
    assert!((found / 0.01 - 1.0).abs() < 0.01, "{found}");
    for seed in 0..20 {
        let x = uniform_inputs(seed, 200, 3 * N_JOINTS);
        let independent = Samples::of_one_context(names(), x, Vec::new()).unwrap();
        assert_eq!(independent.apparent_step(), None, "{seed}");
    }
    assert_eq!(log(&evenly(5, 0.01)).apparent_step(), None, "few rows");
}

/// Noise whose covariance falls as exp(−Δt/T), of standard deviation 1.
fn ornstein_uhlenbeck(seed: u64, n: usize, step: f64, time: f64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || {
        let (radius, angle): (f64, f64) = (rng.random(), rng.random());
        (-2.0 * (1.0 - radius).ln()).sqrt() * (TAU * angle).cos()
    };
    let kept = (-step / time).exp();
    let mut noise = vec![normal()];
    for row in 1..n {
        noise.push(kept * noise[row - 1] + (1.0 - kept * kept).sqrt() * normal());
    }
    noise
}

const STEP: f64 = 0.01;

/// 40 s of a log whose first joint's torque is linear in the state but for noise of a correlation time of 0.3 s.
fn noisy(seed: u64) -> Samples {
    let samples = log(&evenly(4000, STEP));
    let noise = ornstein_uhlenbeck(seed, samples.n_rows(), STEP, 0.3);
    let values = (0..samples.n_rows())
        .map(|row| true_torque(&samples.x, row) + 0.5 * noise[row])
        .collect();
    Samples {
        torques: vec![JointTorques {
            joint_idx: 0,
            values,
        }],
        ..samples
    }
}

fn true_torque(x: &Mat<f64>, row: usize) -> f64 {
    let weights = [3.0, -1.0, 0.8, 0.0, 1.2, 0.3];
    0.7 + (0..6).map(|col| weights[col] * x[(row, col)]).sum::<f64>()
}

/// Share of the states at which the true torque is inside the claimed 95 % interval of the mean, over many logs.
fn coverage(learner: &dyn Learn) -> f64 {
    // Of one motion, 7 s apart, and one beyond it.
    let asked = log(&[3.0, 10.0, 17.0, 24.0, 31.0, 61.0]);
    let (mut inside, mut count) = (0.0, 0.0);
    for seed in 0..200 {
        let model = RobotModel::learn(&noisy(seed), learner, provenance()).unwrap();
        let found = model.predict_joint(0, 0, asked.x.as_ref()).unwrap();
        for row in 0..asked.n_rows() {
            let error = found.mean[row] - true_torque(&asked.x, row);
            inside += f64::from(u8::from(error.abs() <= 1.96 * found.var[row].sqrt()));
            count += 1.0;
        }
    }
    inside / count
}

#[test]
fn intervals_of_a_linear_model_hold_what_they_claim_of_rows_that_are_correlated() {
    let weighted = coverage(&Linear::smooth().by_evidence_within_runs());
    let independent = coverage(&Linear::smooth().by_evidence());
    // 200 independent logs: the standard error of a share of 0.95 is 0.015 if a log's states share their fate.
    // c = (1 + φ)/(1 − φ) = 60 rows count as one: intervals are a √60th of what they should be, and hold 20 %.
    assert!((0.905..=0.99).contains(&weighted), "{weighted}");
    assert!(independent < 0.35, "{independent}");
}

#[test]
fn rows_without_times_or_far_apart_are_learned_from_as_they_are() {
    let samples = noisy(3);
    let sparse = samples.rows(&(0..4000).step_by(400).collect::<Vec<_>>());
    let timeless = Samples {
        timeline: Timeline::default(),
        ..samples.clone()
    };
    for samples in [timeless, sparse] {
        let (x, t) = (samples.x.as_ref(), &samples.torques[0].values);
        let alone = BayesLinear::fit_by_evidence(x, t, LinearForm::Smooth).unwrap();
        let learner = Linear::smooth().by_evidence_within_runs();
        let model = RobotModel::learn(&samples, &learner, provenance()).unwrap();
        let JointModel::Linear(found) = &model.learned()[0].1 else {
            panic!("no linear model");
        };
        assert_eq!(found.weights(), alone.weights());
        assert_eq!(found.r(), alone.r());
        assert_eq!(found.noise_var(), alone.noise_var());
    }
}

#[test]
fn correlation_of_residuals_is_theirs_and_at_least_the_rows_of_three_tenths_of_a_second() {
    let samples = log(&evenly(20_000, STEP));
    // (1 + φ)/(1 − φ) = 60.0; the sum ends at ρ = 0.03, which takes 3 % off it, and 200 s are some 300 independent
    // values, of which a sum of 105 lags has a standard error of a fifth.
    let noise = ornstein_uhlenbeck(5, 20_000, STEP, 0.3);
    let found = residual_correlation(&samples, &noise).unwrap();
    assert!((36.0..=84.0).contains(&found), "{found}");
    let white = ornstein_uhlenbeck(5, 20_000, STEP, 1e-6);
    let found = residual_correlation(&samples, &white).unwrap();
    assert!((found - LEAST_SECONDS / STEP).abs() < 1e-9, "{found}");
}
