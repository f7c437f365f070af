//! Arms in motion under smooth friction, against integrations of other kinds and against energy.

use allocation_counter::measure;
use puma_dyn::dynamics::{kinetic_energy, potential_energy};
use puma_dyn::motion::{
    ArmSimulator, ClosedLoop, CompositeController, GravityFeedForward, ModelFeedForward, Rate,
    ReferenceMotion,
};
use puma_dyn::robot::{
    Drive, HysteresisFriction, Inertial, JointDescription, JointKind, LinkDescription,
    LoadHysteresisFriction, SmoothFriction, TanhFriction,
};
use puma_dyn::{Context, Effects, Model, RobotDescription, Workspace, puma560};

const MASS: f64 = 2.0;
const LENGTH: f64 = 0.5;
const ROTOR: f64 = 0.3;
const VISCOUS: f64 = 0.2;
const GRAVITY: f64 = 9.81;

fn friction(delta: f64) -> SmoothFriction {
    SmoothFriction {
        offset: 0.4,
        tanh: vec![TanhFriction {
            width: 0.05,
            torque: 0.3,
        }],
        hysteresis: vec![HysteresisFriction {
            length: delta,
            torque: 0.5,
        }],
        load_hysteresis: vec![LoadHysteresisFriction {
            length: delta,
            coefficient: 0.1,
        }],
        load_viscous: 0.05,
    }
}

/// A point mass on a rod that swings about y.
fn pendulum(smooth_friction: SmoothFriction) -> Model {
    let mut robot = RobotDescription::new("pendulum");
    let bob = Inertial {
        mass: MASS,
        centre: [0.0, 0.0, -LENGTH],
        inertia: [[0.0; 3]; 3],
    };
    robot.links.push(LinkDescription::new("base", None));
    robot.links.push(LinkDescription::new("rod", Some(bob)));
    robot.joints.push(JointDescription {
        axis: [0.0, 1.0, 0.0],
        drive: Drive {
            rotor_inertia: ROTOR,
            viscous_joint: VISCOUS,
            ..Drive::NONE
        },
        smooth_friction,
        ..JointDescription::new("hinge", JointKind::Continuous, "base", "rod")
    });
    Model::new(&robot).expect("a valid robot")
}

/// d/dt of (q, q̇, z): the load is tried with either sign, and z obeys Dahl's equation in time.
fn slope([q, qd, z]: [f64; 3], tau: f64, delta: f64) -> [f64; 3] {
    let inertia = MASS * LENGTH * LENGTH;
    let gravity = MASS * GRAVITY * LENGTH * q.sin();
    let own = 0.4 + 0.3 * (qd / 0.05).tanh() + 0.5 * z + VISCOUS * qd;
    let share = 0.1 * z + 0.05 * qd;
    let qdd = |sign: f64| {
        let part = 1.0 + sign * share;
        (tau - own - part * gravity) / (part * inertia + ROTOR)
    };
    let fits = |sign: f64| sign * (inertia * qdd(sign) + gravity) >= 0.0;
    let sign = if fits(1.0) { 1.0 } else { -1.0 };
    assert!(fits(sign));
    [qd, qdd(sign), (qd - qd.abs() * z) / delta]
}

/// Steps of the midpoint rule, far shorter than anything in the motion.
fn integrated(q: f64, tau: f64, duration: f64, n: usize, delta: f64) -> [f64; 3] {
    let h = duration / n as f64;
    let mut state = [q, 0.0, 0.0];
    for _ in 0..n {
        let first = slope(state, tau, delta);
        let middle: [f64; 3] = std::array::from_fn(|i| state[i] + 0.5 * h * first[i]);
        let second = slope(middle, tau, delta);
        state = std::array::from_fn(|i| state[i] + h * second[i]);
    }
    state
}

#[test]
fn a_pendulum_swings_as_dahls_equation_in_time_says() {
    let delta = 0.02;
    let model = pendulum(friction(delta));
    for (q, tau) in [(1.2, 0.0), (-0.9, 2.0), (0.05, 0.4)] {
        let arm = ArmSimulator::new(&model, Effects::ALL, Context::empty(), &[q], &[0.0]);
        let (mut arm, mut turns, mut before) = (arm.unwrap(), 0, 0.0);
        for _ in 0..1500 {
            arm.advance(&[tau], 1e-3, 1).unwrap();
            turns += usize::from(arm.qd()[0] * before < 0.0);
            before = arm.qd()[0];
        }
        assert!(turns >= 1, "{q}: {turns}");
        let [exact_q, exact_qd, _] = integrated(q, tau, 1.5, 600_000, delta);
        // Midpoint rule and its kinks at 2.5 µs, Runge–Kutta with the kinks of the load's sign at 1 ms.
        let (dq, dqd) = (arm.q()[0] - exact_q, arm.qd()[0] - exact_qd);
        assert!(
            dq.abs() < 1e-6 && dqd.abs() < 1e-5,
            "{q}, {tau}: {dq:e} {dqd:e}"
        );
    }
}

#[test]
fn friction_that_remembers_holds_an_arm_within_its_length() {
    // 0.5 N·m of hysteresis against 0.3 N·m of offset: at rest z = 0.6, reached within some lengths.
    let delta = 1e-3;
    let holding = SmoothFriction {
        hysteresis: vec![HysteresisFriction {
            length: delta,
            torque: 0.5,
        }],
        tanh: vec![TanhFriction {
            width: 0.5,
            torque: 20.0,
        }],
        offset: -0.3,
        ..SmoothFriction::NONE
    };
    let model = pendulum(holding);
    let arm = ArmSimulator::new(&model, Effects::ALL, Context::empty(), &[0.0], &[0.0]);
    let mut arm = arm.unwrap();
    for _ in 0..4000 {
        arm.advance(&[0.0], 1e-3, 1).unwrap();
    }
    // z = 1 − exp(−q/δ) up to the balance 0.5 z + m g l q = 0.3.
    let q = arm.q()[0];
    let residual = 0.5 * (1.0 - (-q / delta).exp()) + MASS * GRAVITY * LENGTH * q - 0.3;
    assert!(
        residual.abs() < 1e-3 && arm.qd()[0].abs() < 1e-4,
        "{q} {residual}"
    );
}

fn puma() -> Model {
    let mut robot = puma560::description();
    for joint in &mut robot.joints {
        let size = if joint.name.as_str() < "joint4" {
            1.0
        } else {
            0.05
        };
        joint.smooth_friction = SmoothFriction {
            tanh: vec![TanhFriction {
                width: 0.02,
                torque: 1.5 * size,
            }],
            hysteresis: vec![HysteresisFriction {
                length: 2e-3,
                torque: 4.0 * size,
            }],
            load_hysteresis: vec![LoadHysteresisFriction {
                length: 2e-3,
                coefficient: 0.1,
            }],
            load_viscous: 0.03,
            offset: 0.1 * size,
        };
    }
    Model::new(&robot).expect("a valid robot")
}

const Q: [f64; 6] = [0.1, -0.7, 0.4, 0.3, -0.2, 0.9];

#[test]
fn motors_pay_for_energy_and_friction() {
    let model = puma();
    let (effects, context) = (Effects::ALL, Context::empty());
    let mut workspace = Workspace::new(&model);
    let mut energy = |arm: &ArmSimulator<'_>| {
        kinetic_energy(&model, &mut workspace, effects, &context, arm.q(), arm.qd())
            + potential_energy(&model, &mut workspace, &context, arm.q())
    };
    let arm = ArmSimulator::new(&model, effects, Context::empty(), &Q, &[0.0; 6]);
    let mut arm = arm.unwrap();
    let before = energy(&arm);
    for tick in 0..400 {
        let swing = (0.05 * f64::from(tick)).sin();
        let tau = [
            20.0 * swing,
            -40.0 + 30.0 * swing,
            10.0 * swing,
            swing,
            -swing,
            0.6 * swing,
        ];
        arm.advance(&tau, 1e-3, 2).unwrap();
    }
    let gained = energy(&arm) - before;
    let work = arm.work();
    assert!(work.friction > 1.0, "{work:?}");
    let error = work.motors - work.friction - gained;
    assert!(error.abs() < 1e-5 * work.friction, "{error:e} {work:?}");
}

#[test]
fn a_light_arm_with_sharp_friction_does_not_blow_up() {
    let mut robot = puma560::description();
    for joint in &mut robot.joints {
        joint.drive = Drive::NONE;
    }
    robot.joints[5].smooth_friction.tanh = vec![TanhFriction {
        width: 0.01,
        torque: 1.0,
    }];
    let model = Model::new(&robot).unwrap();
    // Joint 6 has 4e-5 kg m²: friction changes within 0.4 µs, a tenth of what 0.5 ms and 1000 pieces can follow.
    let arm = ArmSimulator::new(&model, Effects::ALL, Context::empty(), &Q, &[0.0; 6]);
    let refused = arm
        .unwrap()
        .advance(&[0.0; 6], 1e-3, 2)
        .unwrap_err()
        .to_string();
    assert!(refused.contains("friction changes so fast"), "{refused}");

    let (mut arm, mut largest) = (
        ArmSimulator::new(&model, Effects::ALL, Context::empty(), &Q, &[0.0; 6]).unwrap(),
        0.0_f64,
    );
    for _ in 0..50 {
        arm.advance(&[0.0; 6], 1e-3, 20).unwrap();
        largest = largest.max(arm.qd()[5].abs());
    }
    assert!(largest < 1.0, "{largest}");
}

/// A second of a motion in which every joint turns back.
fn reference() -> ReferenceMotion {
    let time: Vec<f64> = (0..=50).map(|k| 0.02 * f64::from(k)).collect();
    let of_time = |t: &f64| {
        let (s, c) = (5.0 * t).sin_cos();
        let q = Q.map(|q| q + 0.3 * (1.0 - c));
        [q, [1.5 * s; 6], [7.5 * c; 6]].concat()
    };
    let states = time.iter().flat_map(of_time).collect();
    ReferenceMotion::new(6, time, states).expect("a motion")
}

/// Largest error of joint 2 under a feed-forward, rad.
fn largest_error(model: &Model, feed_forward: &mut impl puma_dyn::motion::FeedForward) -> f64 {
    let (reference, all) = (reference(), Effects::ALL);
    let inertias = [3.0, 5.0, 1.0, 0.2, 0.2, 0.2];
    let controller = CompositeController::with_bandwidth(&inertias, 10.0, 1.0).expect("gains");
    let rate = Rate {
        period: 1e-3,
        n_steps: 2,
    };
    let mut robot =
        ClosedLoop::new(model, all, Context::empty(), &reference, rate).expect("an arm");
    let mut largest = 0.0_f64;
    robot
        .run(&controller, feed_forward, f64::INFINITY, |tick| {
            largest = largest.max((tick.desired.q[1] - tick.q[1]).abs());
        })
        .expect("a motion without end");
    largest
}

#[test]
fn feed_forward_with_memory_follows_better_than_without_friction() {
    let model = puma();
    let mut exact = ModelFeedForward::new(&model, Effects::ALL, Context::empty());
    let exact = largest_error(&model, &mut exact);
    let without = puma560::model();
    let mut without = ModelFeedForward::new(&without, Effects::ALL, Context::empty());
    let without = largest_error(&model, &mut without);
    let gravity = largest_error(
        &model,
        &mut GravityFeedForward::new(&model, Context::empty()),
    );
    assert!(
        exact < 0.1 * without && without < gravity,
        "{exact} {without} {gravity}"
    );
}

#[test]
fn nothing_allocates() {
    let model = puma();
    let arm = ArmSimulator::new(&model, Effects::ALL, Context::empty(), &Q, &[0.0; 6]);
    let mut arm = arm.unwrap();
    let report = measure(|| {
        for _ in 0..10 {
            assert!(
                arm.advance(&[5.0, -40.0, 3.0, 1.0, 1.0, 1.0], 1e-3, 2)
                    .is_ok()
            );
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}
