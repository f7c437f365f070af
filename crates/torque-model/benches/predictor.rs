//! Latency of one call of the predictor: six joints, mean and variance, by kind of model.
//!
//! GPc from 4000 samples on pivots, LRc, rbd and rbd+gp from 400 samples of the PUMA 560.
//! Criterion times the call in bulk; a histogram of single calls follows, which
//! is what a control loop meets. Both run after the answers are checked.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use criterion::{BatchSize, Criterion};
use faer::Mat;
use gp_core::{BayesLinear, FitOptions, LikelihoodOptions, LinearForm, Method, Posterior};
use kernels::{Covariance, OnColumns, Sum, TorqueCovariance, TorqueParams};
use torque_model::learn::{RigidBody, RigidBodyForm};
use torque_model::{
    FitSummary, JointModel, ModelParts, Predictor, Process, Provenance, RegressorRows, Robot,
    RobotModel, RobotSource, Rows, States, TrainingRanges,
};

const N_JOINTS: usize = 6;
const N_SAMPLES: usize = 4000;
/// Samples of a rigid body: more than parameters.
const N_OF_ROBOT: usize = 400;
const N_CALLS: usize = 200_000;
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

fn options() -> LikelihoodOptions {
    LikelihoodOptions {
        method: Method::Certified,
        ..LikelihoodOptions::automatic()
    }
}

fn process<C: Covariance, R: Rows>(
    covariance: C,
    rows: R,
    x: &Mat<f64>,
    joint: usize,
) -> Box<Process<C, R>> {
    let at = rows.rows(0, x.as_ref()).expect("the states are finite");
    let known = rows.known_mean(at.as_ref());
    let mut targets = torques(x, joint);
    for (target, known) in targets.iter_mut().zip(known.unwrap_or_default()) {
        *target -= known;
    }
    let posterior = Posterior::new(covariance, NOISE_STD, at.as_ref(), &targets, options())
        .expect("the data is finite");
    Box::new(Process {
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
        rows,
    })
}

fn gpc(x: &Mat<f64>, joint: usize) -> JointModel {
    let rows = States { n_joints: N_JOINTS };
    JointModel::Process(process(covariance(joint), rows, x, joint))
}

fn lrc(x: &Mat<f64>, joint: usize) -> JointModel {
    let targets = torques(x, joint);
    BayesLinear::fit(x.as_ref(), &targets, LinearForm::Coulomb)
        .expect("the data is finite")
        .into()
}

fn puma() -> Robot {
    Robot::new(RobotSource::puma560(), "puma560").expect("it is built in")
}

fn informed(robot: &Robot, form: RigidBodyForm, x: &Mat<f64>, joint: usize) -> JointModel {
    let rows = RegressorRows {
        robot: Arc::clone(&robot.model),
        joint_idx: joint,
        prior: RigidBody::new(robot.clone(), form, FitOptions::chapter()).prior,
    };
    let d = 3 * N_JOINTS;
    let parameters = rows.prior.covariance(d).expect("the prior is finite");
    match form {
        RigidBodyForm::Alone => JointModel::RigidBody(process(parameters, rows, x, joint)),
        RigidBodyForm::WithProcess => {
            let remainder = OnColumns::new(covariance(0), 0..d);
            let both = Sum::new(remainder, parameters);
            JointModel::RigidBodyAndProcess(process(both, rows, x, joint))
        }
    }
}

fn model(
    x: &Mat<f64>,
    robot: Option<&Robot>,
    joint_model: impl Fn(&Mat<f64>, usize) -> JointModel,
) -> RobotModel {
    let learned = (0..N_JOINTS).map(|joint| (joint, joint_model(x, joint)));
    RobotModel::new(ModelParts {
        joint_names: puma().model.joint_names().to_vec(),
        contexts: Vec::new(),
        learned: learned.collect(),
        ranges: TrainingRanges::of(x.as_ref()).expect("the data is finite"),
        context_ranges: Vec::new(),
        selection: None,
        robot: robot.map(|robot| robot.source.clone()),
        provenance: Provenance::new("benchmark", &[]),
    })
    .expect("the parts fit together")
}

/// A model of each kind.
fn models() -> [(&'static str, RobotModel); 4] {
    let (x, robot) = (curves(0.0), puma());
    let few = Mat::from_fn(N_OF_ROBOT, 3 * N_JOINTS, |row, col| {
        x[(row * N_SAMPLES / N_OF_ROBOT + row % 2, col)]
    });
    let of_robot = |form: RigidBodyForm| {
        model(&few, Some(&robot), |x, joint| {
            informed(&robot, form, x, joint)
        })
    };
    [
        ("gpc", model(&x, None, gpc)),
        ("lrc", model(&x, None, lrc)),
        ("rbd", of_robot(RigidBodyForm::Alone)),
        ("rbd+gp", of_robot(RigidBodyForm::WithProcess)),
    ]
}

/// States between those trained on, row after row.
fn states() -> Vec<f64> {
    let x = curves(0.5);
    let rows = x.row_iter();
    rows.flat_map(|row| row.iter().copied()).collect()
}

/// The predictor must agree with the batch to a hundredth of the noise at every state.
fn check(model: &RobotModel, predictor: &Predictor, states: &[f64]) {
    let x = curves(0.5);
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
    let of_joint = |joint: usize| model.predict_joint(joint, 0, x.as_ref());
    let expected: Vec<_> = (0..N_JOINTS)
        .map(|joint| of_joint(joint).expect("the states are finite"))
        .collect();
    for (row, x) in states.chunks_exact(3 * N_JOINTS).enumerate() {
        predictor
            .predict_into(0, &mut scratch, x, &mut mean, &mut var)
            .expect("the states are finite");
        for (joint, expected) in expected.iter().enumerate() {
            let error = (mean[joint] - expected.mean[row]).abs();
            assert!(
                error < 0.01 * NOISE_STD,
                "{row} {joint}: mean off by {error:e}"
            );
            let error = (var[joint] - expected.var[row]).abs();
            assert!(
                error < 0.01 * NOISE_STD.powi(2).max(expected.var[row]),
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
        let result = predictor.predict_into(0, &mut scratch, black_box(x), &mut mean, &mut var);
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
    let states = states();
    let mut criterion = Criterion::default().configure_from_args();
    for (kind, model) in models() {
        let predictor = model.predictor();
        let ranks = model.learned().iter();
        let ranks: Vec<usize> = ranks
            .filter_map(|(_, m)| m.summary())
            .map(|s| s.rank)
            .collect();
        println!("{kind}: {N_JOINTS} joints, ranks {ranks:?}");
        check(&model, &predictor, &states);

        let mut scratch = predictor.scratch();
        let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
        let mut rows = states.chunks_exact(3 * N_JOINTS).cycle();
        criterion.bench_function(&format!("predict_into/6 joints/{kind}"), |b| {
            b.iter_batched(
                || rows.next().unwrap_or_default(),
                |x| predictor.predict_into(0, &mut scratch, x, &mut mean, &mut var),
                BatchSize::SmallInput,
            );
        });
        histogram(&predictor, &states);
    }
    criterion.final_summary();
}
