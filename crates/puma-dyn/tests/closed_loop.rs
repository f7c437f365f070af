//! The whole loop: tracking with the exact model, steps that converge, and what feed-forward is worth.

use allocation_counter::measure;
use puma_dyn::motion::{
    ClosedLoop, CompositeController, FeedForward, JointState, ModelFeedForward, NoFeedForward,
    Rate, ReferenceMotion,
};
use puma_dyn::{Context, Scenario};

/// Typical inertias of the joints, rotors included, kg m².
const INERTIAS: [f64; 6] = [3.0, 4.5, 1.2, 0.2, 0.18, 0.2];

/// A controller of 1 kHz.
const USUAL: Rate = Rate {
    period: 1e-3,
    n_steps: 2,
};

/// The last 1.2 s of the fastest run of a path that turns all joints back.
fn reference(scenario: &Scenario) -> ReferenceMotion {
    let trajectory = scenario.trajectory(3, 3).expect("valid in this test");
    let first = 3000;
    let states = trajectory.states[first * 18..].to_vec();
    ReferenceMotion::new(6, trajectory.time[first..].to_vec(), states).expect("valid in this test")
}

fn context(scenario: &Scenario, load: usize) -> Context {
    let model = scenario.model();
    let payload = scenario.payload(load);
    model
        .attach(model.frames().len() - 1, payload)
        .expect("valid in this test")
        .into()
}

/// Positions at every tick, row after row.
fn positions(
    scenario: &Scenario,
    feed_forward: &mut impl FeedForward,
    bandwidth: f64,
    rate: Rate,
) -> (Vec<f64>, f64) {
    let reference = reference(scenario);
    let controller =
        CompositeController::with_bandwidth(&INERTIAS, bandwidth, 1.0).expect("valid in this test");
    let (model, effects) = (scenario.model(), scenario.effects());
    let mut robot = ClosedLoop::new(model, effects, context(scenario, 9), &reference, rate)
        .expect("valid in this test");
    let (mut positions, mut squares) = (Vec::new(), 0.0);
    robot
        .run(&controller, feed_forward, f64::INFINITY, |tick| {
            positions.extend(tick.q);
            let errors = tick.q.iter().zip(&tick.desired.q);
            squares += errors
                .map(|(q, desired)| (q - desired).powi(2))
                .sum::<f64>();
        })
        .expect("valid in this test");
    assert_eq!(positions.len(), 6 * robot.n_ticks());
    let rms = (squares / positions.len() as f64).sqrt();
    (positions, rms)
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max)
}

#[test]
fn the_loop_converges_with_the_step_of_the_integration() {
    let scenario = Scenario::reference();
    let error_of = |period: f64, n_steps: usize| {
        let run = |n_steps| {
            let rate = Rate { period, n_steps };
            positions(&scenario, &mut NoFeedForward, 15.0, rate).0
        };
        farthest(&run(n_steps), &run(64))
    };
    // In these ticks no joint is torn loose between two steps: order 4, 256 for a quarter of the step.
    let [coarse, fine] = [1, 4].map(|n_steps| error_of(4e-3, n_steps));
    assert!(
        coarse < 1e-9 && fine < coarse / 100.0,
        "{coarse:e} {fine:e} rad"
    );
    // Where one is, it starts late by a part of a step: order 2.
    let [coarse, fine] = [1, 16].map(|n_steps| error_of(16e-3, n_steps));
    assert!(
        coarse < 1e-6 && fine < coarse / 30.0,
        "{coarse:e} {fine:e} rad"
    );
    // At 1 kHz one step a tick is enough.
    let usual = error_of(1e-3, 1);
    assert!(usual < 1e-8, "{usual:e} rad");
}

#[test]
fn the_exact_model_needs_almost_no_correction_and_no_model_leaves_a_large_error() {
    let scenario = Scenario::reference();
    let load = context(&scenario, 9);
    let mut exact = ModelFeedForward::new(scenario.model(), scenario.effects(), load);
    let (_, with_model) = positions(&scenario, &mut exact, 10.0, USUAL);
    let (_, without) = positions(&scenario, &mut NoFeedForward, 10.0, USUAL);
    // What is left is the hold of a tick: torques lag by half a millisecond.
    assert!(
        with_model < 1e-3 && without > 50.0 * with_model,
        "{with_model:e} {without:e}"
    );
}

#[test]
fn a_run_in_two_parts_is_the_run() {
    let scenario = Scenario::reference();
    let reference = reference(&scenario);
    let controller = CompositeController::with_bandwidth(&INERTIAS, 10.0, 1.0).unwrap();
    let end = |cuts: &[f64]| {
        let (model, effects) = (scenario.model(), scenario.effects());
        let robot = ClosedLoop::new(model, effects, Context::empty(), &reference, USUAL);
        let mut robot = robot.unwrap();
        for until in cuts {
            robot
                .run(&controller, &mut NoFeedForward, *until, |_| {})
                .unwrap();
        }
        robot.arm().q().to_vec()
    };
    assert_eq!(end(&[f64::INFINITY]), end(&[0.5, 0.7001, f64::INFINITY]));
}

#[test]
fn ticks_allocate_nothing() {
    let scenario = Scenario::reference();
    let reference = reference(&scenario);
    let controller = CompositeController::with_bandwidth(&INERTIAS, 10.0, 1.0).unwrap();
    let (model, effects) = (scenario.model(), scenario.effects());
    let mut robot =
        ClosedLoop::new(model, effects, context(&scenario, 3), &reference, USUAL).unwrap();
    let mut exact = ModelFeedForward::new(model, effects, context(&scenario, 3));
    let report = measure(|| {
        let run = robot.run(&controller, &mut exact, f64::INFINITY, |_| {});
        assert!(run.is_ok());
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}

#[test]
fn a_closure_is_a_feed_forward_and_its_nan_stops_the_run_with_the_joints_name() {
    let scenario = Scenario::reference();
    let reference = reference(&scenario);
    let controller = CompositeController::with_bandwidth(&INERTIAS, 10.0, 1.0).unwrap();
    let (model, effects) = (scenario.model(), scenario.effects());
    let robot = ClosedLoop::new(model, effects, Context::empty(), &reference, USUAL);
    let mut learned = |_: &JointState, tau: &mut [f64]| tau[1] = f64::NAN;
    let run = robot
        .unwrap()
        .run(&controller, &mut learned, f64::INFINITY, |_| {});
    assert_eq!(
        run.unwrap_err().to_string(),
        "joint `joint2`: torque is NaN"
    );

    let short = ReferenceMotion::new(1, vec![0.0, 1.0], vec![0.0; 6]).unwrap();
    let refused = ClosedLoop::new(model, effects, Context::empty(), &short, USUAL);
    let message = refused.unwrap_err().to_string();
    assert!(
        message.contains("moves 1 joints, the robot has 6"),
        "{message}"
    );
}
