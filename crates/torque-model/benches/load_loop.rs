//! Latency of one tick of a loop with rbd whose friction has memory: six joints, the PUMA 560 along its paths.
//!
//! A prediction is the hysteresis states, the means and the variances; on line, a tick follows and weighs the load.
//! Criterion times the calls in bulk; a histogram of single calls follows, which is what a control loop meets.

use std::hint::black_box;
use std::time::Instant;

use criterion::{BatchSize, Criterion};
use faer::Mat;
use puma_dyn::Scenario;
use torque_model::learn::SharedParameters;
use torque_model::rigid_body::{FitSettings, OnlineSettings, TermSet};
use torque_model::{JointTorques, Provenance, Robot, RobotModel, RobotSource, Samples, Timeline};

const N_JOINTS: usize = 6;
const N_CALLS: usize = 50_000;
/// Runs learned from, and how many of their samples; 10 ms apart at s3.
const RUNS: [(&str, &str, &str); 4] = [
    ("c1", "p1", "s3"),
    ("c1", "p2", "s3"),
    ("c9", "p2", "s3"),
    ("c14", "p3", "s3"),
];
const EVERY: usize = 4;
const STEP: f64 = 0.01;

/// States and torques of a run, row after row.
fn run((load, path, speed): (&str, &str, &str)) -> (Vec<f64>, Vec<f64>) {
    let scenario = Scenario::reference();
    let place = |found: Result<usize, puma_dyn::DynError>| found.expect("the scenario has it");
    let (path, speed) = (
        place(scenario.path_idx(path)),
        place(scenario.speed_idx(speed)),
    );
    let trajectory = scenario.trajectory(path, speed).expect("it can be reached");
    let torques = scenario.torques(&trajectory, place(scenario.load_idx(load)));
    let every = |values: &[f64], width: usize| -> Vec<f64> {
        let rows = values.chunks_exact(width).step_by(EVERY);
        rows.flatten().copied().collect()
    };
    (
        every(&trajectory.states, 3 * N_JOINTS),
        every(&torques, N_JOINTS),
    )
}

fn model() -> RobotModel {
    let runs: Vec<_> = RUNS.iter().map(|of| run(*of)).collect();
    let rows: Vec<(usize, usize)> = (runs.iter().enumerate())
        .flat_map(|(run, (_, torques))| (0..torques.len() / N_JOINTS).map(move |row| (run, row)))
        .collect();
    let loads = ["c1", "c9", "c14"].map(str::to_owned);
    let load_of = |run: usize| loads.iter().position(|load| load == RUNS[run].0);
    let robot = Robot::new(RobotSource::puma560(), "puma560").expect("it is built in");
    let of_joint = |joint_idx: usize| JointTorques {
        joint_idx,
        values: (rows.iter())
            .map(|(run, row)| runs[*run].1[row * N_JOINTS + joint_idx])
            .collect(),
    };
    let samples = Samples {
        joint_names: robot.model.joint_names().to_vec(),
        context_of: rows.iter().filter_map(|(run, _)| load_of(*run)).collect(),
        contexts: loads.to_vec(),
        x: Mat::from_fn(rows.len(), 3 * N_JOINTS, |at, col| {
            let (run, row) = rows[at];
            runs[run].0[row * 3 * N_JOINTS + col]
        }),
        torques: (0..N_JOINTS).map(of_joint).collect(),
        timeline: Timeline {
            run_of: rows.iter().map(|(run, _)| *run).collect(),
            run_names: (0..RUNS.len()).map(|run| format!("run {run}")).collect(),
            t: rows.iter().map(|(_, row)| *row as f64 * STEP).collect(),
            ..Timeline::default()
        },
        continuous: torque_model::ContinuousJoints::none(),
    };
    let learner = SharedParameters {
        robot,
        terms: Some(TermSet::Standard),
        settings: FitSettings::default(),
    };
    RobotModel::learn(&samples, &learner, Provenance::new("benchmark", &[]))
        .expect("the samples are the robot's")
}

/// Prints where single calls lie.
#[allow(
    clippy::print_stdout,
    reason = "the histogram is what the benchmark is for"
)]
fn histogram(what: &str, mut call: impl FnMut(usize)) {
    let mut nanoseconds: Vec<u128> = Vec::with_capacity(N_CALLS);
    for idx in 0..N_CALLS {
        let start = Instant::now();
        call(idx);
        nanoseconds.push(start.elapsed().as_nanos());
    }
    nanoseconds.sort_unstable();
    let micros = |per_1000: usize| nanoseconds[(N_CALLS - 1) * per_1000 / 1000] as f64 * 1e-3;
    println!(
        "{what}: single calls, µs, of {N_CALLS}: p50 {:.2}, p99 {:.2}, p99.9 {:.2}",
        micros(500),
        micros(990),
        micros(999)
    );
}

#[allow(clippy::print_stdout, reason = "the directions decide the time")]
fn main() {
    let model = model();
    let (states, torques) = run(("c9", "p4", "s3"));
    let ticks: Vec<_> = (states.chunks_exact(3 * N_JOINTS))
        .zip(torques.chunks_exact(N_JOINTS))
        .collect();
    let mut criterion = Criterion::default().configure_from_args();

    let predictor = model.predictor();
    let (mut scratch, mut memory) = (predictor.scratch(), model.hysteresis());
    let mut x = vec![0.0; model.n_covariates()];
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
    let mut predict = |state: &[f64]| {
        memory.advance(&state[N_JOINTS..2 * N_JOINTS], STEP);
        x[..state.len()].copy_from_slice(state);
        x[state.len()..].copy_from_slice(memory.states());
        let outcome = predictor.predict_into(1, &mut scratch, black_box(&x), &mut mean, &mut var);
        assert!(outcome.is_ok());
        black_box((&mean, &var));
    };
    let mut rows = ticks.iter().cycle();
    criterion.bench_function("predict_into/6 joints/rbd with memory", |b| {
        b.iter_batched(
            || rows.next().map_or(&[][..], |(state, _)| *state),
            &mut predict,
            BatchSize::SmallInput,
        );
    });
    histogram("mean and variance", |idx| {
        predict(ticks[idx % ticks.len()].0);
    });

    let settings = OnlineSettings::default();
    let mut online = model.online_load(settings).expect("it is rbd");
    println!("on line: {} directions", online.n_directions());
    let (mut memory, mut x) = (model.hysteresis(), vec![0.0; model.n_covariates()]);
    let mut follow = |(state, torques): (&[f64], &[f64])| {
        memory.advance(&state[N_JOINTS..2 * N_JOINTS], STEP);
        x[..state.len()].copy_from_slice(state);
        x[state.len()..].copy_from_slice(memory.states());
        assert!(online.update(black_box(&x), torques, STEP).is_ok());
        black_box(online.probabilities());
    };
    let mut rows = ticks.iter().cycle();
    criterion.bench_function("online_load/6 joints, 3 loads", |b| {
        b.iter_batched(
            || rows.next().map_or((&[][..], &[][..]), |tick| *tick),
            &mut follow,
            BatchSize::SmallInput,
        );
    });
    histogram("load on line", |idx| follow(ticks[idx % ticks.len()]));
    criterion.final_summary();
}
