//! Latency of one call of the predictor: six joints, mean and variance, from 4000 samples.
//!
//! Criterion times the call in bulk; a histogram of single calls follows, which
//! is what a control loop meets. Both run after the answers are checked.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BatchSize, Criterion};
use faer::Mat;
use gp_core::{FitSummary, JointModel, LikelihoodOptions, Method, Posterior, Predictor, ProcessModel, Provenance, TorqueModel, TrainingRanges};
use kernels::{TorqueCovariance, TorqueParams};

const N_JOINTS: usize = 6;
const N_SAMPLES: usize = 4000;
const N_CALLS: usize = 400_000;
/// σ, N·m: the floor of the chapter, where ranks are highest.
const NOISE_STD: f64 = 0.01;

/// Two closed curves with their rates; every joint swings at its own frequencies.
fn curves(shift: f64) -> Mat<f64> {
    Mat::from_fn(N_SAMPLES, 3 * N_JOINTS, |row, col| {
        let (curve, joint) = (row % 2, col % N_JOINTS);
        let rate = 1.0 + (joint + curve) as f64 % 3.0;
        let time = (row as f64 + shift) * std::f64::consts::TAU / N_SAMPLES as f64;
        let phase = rate * time + joint as f64 + 0.7 * curve as f64;
        [phase.sin(), rate * phase.cos(), -rate * rate * phase.sin()][col / N_JOINTS]
    })
}

fn torques(x: &Mat<f64>, joint: usize) -> Vec<f64> {
    (0..x.nrows())
        .map(|row| {
            let (q, qd, qdd) = (x[(row, joint)], x[(row, 6 + joint)], x[(row, 12 + joint)]);
            20.0 * q.sin() + 2.0 * qd.signum() + qd + 3.0 * qdd * x[(row, (joint + 1) % 6)].cos()
        })
        .collect()
}

/// GPc whose length scales are shorter for every further joint, so that ranks spread.
fn covariance(joint: usize) -> TorqueCovariance {
    let shrink = 1.0 + 0.1 * joint as f64;
    let length_scales = (0..3 * N_JOINTS).map(|col| [12.0, 24.0, 48.0][col / N_JOINTS] / shrink);
    TorqueCovariance::new(TorqueParams {
        bias_std: 3.0,
        linear_std: vec![2.0; 3 * N_JOINTS],
        signal_std: 15.0,
        length_scales: length_scales.collect(),
        coulomb_std: Some(vec![1.5; N_JOINTS]),
    })
    .expect("hyperparameters are positive")
}

fn joint_model(x: &Mat<f64>, joint: usize) -> JointModel {
    let options = LikelihoodOptions {
        method: Method::Certified,
        ..LikelihoodOptions::automatic()
    };
    let targets = torques(x, joint);
    let posterior = Posterior::new(covariance(joint), NOISE_STD, x.as_ref(), &targets, options)
        .expect("the data is finite");
    JointModel::Process(Box::new(ProcessModel {
        summary: FitSummary {
            log_marginal: 0.0,
            start: "given".to_owned(),
            n_starts: 1,
            evaluations: 1,
            bounds_hit: vec![],
            condition_lower_bound: 1.0,
            method: "certified".to_owned(),
            rank: posterior.rank(),
            error_bound: None,
        },
        posterior,
    }))
}

fn model() -> TorqueModel {
    let x = curves(0.0);
    let learned = (0..N_JOINTS).map(|joint| (joint, joint_model(&x, joint)));
    let provenance = Provenance {
        data_sha256: [0; 32],
        robot_sha256: None,
        program: "benchmark".to_owned(),
        context: String::new(),
    };
    TorqueModel::new(
        (1..=N_JOINTS)
            .map(|joint| format!("joint{joint}"))
            .collect(),
        learned.collect(),
        TrainingRanges::of(x.as_ref()).expect("the data is finite"),
        provenance,
    )
    .expect("the parts fit together")
}

/// States between those trained on, row after row.
fn states() -> Vec<f64> {
    let x = curves(0.5);
    let rows = x.row_iter();
    rows.flat_map(|row| row.iter().copied()).collect()
}

/// The predictor must agree with the model to a hundredth of the noise at every state.
fn check(model: &TorqueModel, predictor: &Predictor, states: &[f64]) {
    let x = curves(0.5);
    let expected = model.predict(x.as_ref()).expect("the states are finite");
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
    for (row, x) in states.chunks_exact(3 * N_JOINTS).enumerate() {
        predictor
            .predict_into(&mut scratch, x, &mut mean, &mut var)
            .expect("the states are finite");
        for (joint, expected) in expected.iter().enumerate() {
            let error = (mean[joint] - expected.mean[row]).abs();
            assert!(
                error < 0.01 * NOISE_STD,
                "{row} {joint}: mean off by {error:e}"
            );
            let error = (var[joint] - expected.var[row]).abs();
            assert!(
                error < 0.01 * NOISE_STD.powi(2),
                "{row} {joint}: variance off by {error:e}"
            );
        }
    }
}

/// Times every call by itself and prints where the calls lie.
#[allow(
    clippy::print_stdout,
    reason = "the histogram is what the benchmark is for"
)]
fn histogram(predictor: &Predictor, states: &[f64]) {
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
    let mut nanoseconds: Vec<u128> = Vec::with_capacity(N_CALLS);
    for x in states.chunks_exact(3 * N_JOINTS).cycle().take(N_CALLS) {
        let start = Instant::now();
        let result = predictor.predict_into(&mut scratch, black_box(x), &mut mean, &mut var);
        nanoseconds.push(start.elapsed().as_nanos());
        assert!(black_box(result).is_ok());
        black_box((&mean, &var));
    }
    nanoseconds.sort_unstable();
    let micros = |idx: usize| nanoseconds[idx] as f64 * 1e-3;
    println!("single calls, µs, of {N_CALLS}:");
    for (name, per_100_000) in [
        ("p50", 50_000),
        ("p90", 90_000),
        ("p99", 99_000),
        ("p99.9", 99_900),
        ("p99.99", 99_990),
    ] {
        println!(
            "  {name:>6} {:9.2}",
            micros((N_CALLS - 1) * per_100_000 / 100_000)
        );
    }
    println!("  {:>6} {:9.2}", "max", micros(N_CALLS - 1));
}

#[allow(clippy::print_stdout, reason = "the ranks decide the time")]
fn main() {
    let (model, states) = (model(), states());
    let predictor = model.predictor();
    let ranks = model.learned().iter();
    let ranks: Vec<usize> = ranks
        .filter_map(|(_, m)| m.summary())
        .map(|s| s.rank)
        .collect();
    println!("{N_JOINTS} joints, {N_SAMPLES} samples, ranks {ranks:?}");
    check(&model, &predictor, &states);

    let mut criterion = Criterion::default().configure_from_args();
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
    let mut rows = states.chunks_exact(3 * N_JOINTS).cycle();
    criterion.bench_function("predict_into/6 joints/n=4000", |b| {
        b.iter_batched(
            || rows.next(),
            |x| predictor.predict_into(&mut scratch, x.unwrap_or_default(), &mut mean, &mut var),
            BatchSize::SmallInput,
        );
    });
    criterion.final_summary();
    histogram(&predictor, &states);
}
