//! The motion of arms: periods, energy, and the torques that inverse dynamics finds in it.

use std::f64::consts::PI;

use allocation_counter::measure;
use puma_dyn::dynamics::{kinetic_energy, potential_energy};
use puma_dyn::motion::{ArmSimulator, CompliantWall, SlipMode};
use puma_dyn::robot::{Inertial, JointDescription, JointKind, LinkDescription};
use puma_dyn::{Context, Effects, Model, Payload, RobotDescription, Workspace, puma560, rnea};

use crate::random_tree::{Joints, cases};

/// A uniform rod of a metre, hinged at one end about y, hanging down at q = 0.
fn rod() -> Model {
    let mut robot = RobotDescription::new("rod");
    robot.links.push(LinkDescription::new("base", None));
    let inertial = Inertial {
        mass: 3.0,
        centre: [0.0, 0.0, -0.5],
        inertia: [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.0]],
    };
    robot
        .links
        .push(LinkDescription::new("rod", Some(inertial)));
    robot.joints.push(JointDescription {
        axis: [0.0, 1.0, 0.0],
        ..JointDescription::new("hinge", JointKind::Continuous, "base", "rod")
    });
    Model::new(&robot).expect("valid in this test")
}

/// Complete elliptic integral of the first kind K(k), by Gauss's arithmetic-geometric mean.
fn elliptic_k(k: f64) -> f64 {
    let (mut a, mut b) = (1.0, (1.0 - k * k).sqrt());
    for _ in 0..8 {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    PI / (2.0 * a)
}

#[test]
fn a_pendulum_swings_in_the_period_of_the_elliptic_integral() {
    // Rod: I = m L²/3 about the hinge, m g L/2; T = 4 √(2L/3g) K(sin θ₀/2), with θ₀ = 2.5 rad.
    let model = rod();
    let largest: f64 = 2.5;
    let quarter = (2.0 / (3.0 * 9.81_f64)).sqrt() * elliptic_k((largest / 2.0).sin());
    let error_of = |n_steps: usize| {
        let start = ([largest], [0.0]);
        let rigid = Effects::RIGID_BODY;
        let arm = ArmSimulator::new(&model, rigid, Context::empty(), &start.0, &start.1);
        let mut arm = arm.unwrap();
        arm.advance(&[0.0], quarter, n_steps).unwrap();
        let at_bottom = arm.q()[0].abs();
        arm.advance(&[0.0], 3.0 * quarter, 3 * n_steps).unwrap();
        at_bottom.max((arm.q()[0] - largest).abs())
    };
    let (coarse, fine) = (error_of(100), error_of(200));
    assert!(coarse < 1e-6, "{coarse:e}");
    let order = (coarse / fine).log2();
    assert!(
        (order - 4.0).abs() < 0.5,
        "order {order}: {coarse:e} {fine:e}"
    );
}

fn energy(model: &Model, effects: Effects, context: &Context, arm: &ArmSimulator<'_>) -> f64 {
    let mut workspace = Workspace::new(model);
    let (q, qd) = (arm.q(), arm.qd());
    kinetic_energy(model, &mut workspace, effects, context, q, qd)
        + potential_energy(model, &mut workspace, context, q)
}

#[test]
fn trees_in_free_motion_keep_their_energy_to_the_order_of_the_step() {
    let mut orders = Vec::new();
    for case in cases(Joints::Mixed).take(12) {
        let n = case.model.n_joints();
        let drift = |n_steps: usize| {
            let rigid = Effects::RIGID_BODY;
            let context = case.context.clone();
            let arm = ArmSimulator::new(&case.model, rigid, context, &case.q, &case.qd);
            let mut arm = arm.unwrap();
            let before = energy(&case.model, rigid, &case.context, &arm);
            arm.advance(&vec![0.0; n], 0.2, n_steps).unwrap();
            (energy(&case.model, rigid, &case.context, &arm) - before).abs()
        };
        orders.push((drift(200) / drift(400)).log2());
    }
    orders.sort_by(f64::total_cmp);
    // Energy errors of RK4 shrink with the fourth or fifth power; chance can cancel one of two.
    let median = orders[orders.len() / 2];
    assert!((3.7..=5.5).contains(&median), "{orders:?}");
}

const Q: [f64; 6] = [0.1, -0.7, 0.4, 1.3, -0.6, 0.9];

fn loaded(model: &Model) -> Context {
    let payload = Payload::cuboid(2.0, [0.1, 0.2, 0.3], [0.02, 0.0, 0.1], [0.3, 0.0, 0.0]);
    let flange = model
        .frame_idx(puma560::LAST_LINK)
        .expect("valid in this test");
    model
        .attach(flange, &payload.expect("valid in this test"))
        .expect("valid in this test")
        .into()
}

#[test]
fn work_is_the_change_of_energy_and_what_friction_and_the_wall_take() {
    let model = puma560::model();
    let context = loaded(&model);
    let frame_idx = model.frame_idx(puma560::LAST_LINK).unwrap();
    let tip = puma_dyn::forward_kinematics(&model, frame_idx, &Q).translation;
    let imbalance = |n_steps: usize| {
        let arm = ArmSimulator::new(&model, Effects::ALL, context.clone(), &Q, &[0.0; 6]);
        let wall = CompliantWall {
            frame_idx,
            tip: [0.0; 3],
            point: [tip.x, tip.y, tip.z - 0.01],
            normal: [0.0, 0.0, 1.0],
            stiffness: 2e4,
            dissipation: 1.0,
        };
        let mut arm = arm.unwrap().with_wall(wall).unwrap();
        let before = energy(&model, Effects::ALL, &context, &arm);
        let (mut n_sticking, mut strongest) = (0, 0.0_f64);
        for tick in 0..500 {
            let phase = 0.02 * f64::from(tick);
            let tau = [30.0, -20.0, 8.0, 2.0, -1.5, 1.0].map(|size| size * phase.sin());
            arm.advance(&tau, 1e-3, n_steps).unwrap();
            let stuck = arm
                .modes()
                .iter()
                .filter(|mode| **mode == SlipMode::Sticking);
            n_sticking += stuck.count();
            strongest = strongest.max(arm.wall_force());
        }
        assert!(
            n_sticking > 100 && strongest > 100.0,
            "{n_sticking} {strongest}"
        );
        let work = arm.work();
        assert!(work.friction > 1.0 && work.wall < 0.0, "{work:?}");
        let gained = energy(&model, Effects::ALL, &context, &arm) - before;
        (gained - (work.motors - work.friction + work.wall)).abs()
    };
    // The kink at the wall's surface leaves second order there, all else is of order four.
    let (coarse, fine) = (imbalance(1), imbalance(8));
    assert!(
        coarse < 1e-3 && fine < coarse / 30.0,
        "{coarse:e} {fine:e} J"
    );
}

#[test]
fn inverse_dynamics_of_the_motion_gives_the_torques_back() {
    let model = puma560::model();
    let context = loaded(&model);
    let tau = [20.0, -60.0, 10.0, 2.0, -1.5, 1.2];
    let qd = [0.5, -0.6, 0.8, 0.9, -0.7, 0.4];
    let arm = ArmSimulator::new(&model, Effects::ALL, context.clone(), &Q, &qd);
    let mut arm = arm.unwrap();
    let span = 1e-3;
    arm.advance(&tau, span, 4).unwrap();
    let (q, middle) = (arm.q().to_vec(), arm.qd().to_vec());
    arm.advance(&tau, span, 4).unwrap();
    let turns_back = |(before, after): (&f64, &f64)| before * after <= 0.0;
    assert!(!qd.iter().zip(arm.qd()).any(turns_back), "{:?}", arm.qd());

    // q̈ by central differences over ±1 ms: error h²/6 |q⁗|.
    let ends = arm.qd().iter().zip(&qd);
    let qdd: Vec<f64> = ends
        .map(|(after, before)| (after - before) / (2.0 * span))
        .collect();
    let mut found = [0.0; 6];
    let mut workspace = Workspace::new(&model);
    rnea(
        &model,
        &mut workspace,
        Effects::ALL,
        &context,
        &q,
        &middle,
        &qdd,
        &mut found,
    );
    for (found, tau) in found.iter().zip(&tau) {
        assert!((found - tau).abs() < 1e-3, "{found} {tau}");
    }
}

#[test]
fn an_arm_held_by_friction_stays_where_it_is_to_the_bit() {
    let model = puma560::model();
    let arm = ArmSimulator::new(&model, Effects::ALL, loaded(&model), &Q, &[0.0; 6]);
    let mut arm = arm.unwrap();
    let mut workspace = Workspace::new(&model);
    let mut tau = [0.0; 6];
    let context = loaded(&model);
    puma_dyn::dynamics::gravity_torques(&model, &mut workspace, &context, &Q, &mut tau);
    // Nine tenths of Corke's Coulomb torques |G| Tc⁺.
    for (tau, coulomb) in tau.iter_mut().zip([24.7, 13.5, 7.0, 0.85, 0.66, 0.30]) {
        *tau += 0.9 * coulomb;
    }
    arm.advance(&tau, 1.0, 1000).unwrap();
    assert_eq!(arm.q(), Q);
    assert_eq!(arm.modes(), [SlipMode::Sticking; 6]);
    // 1.1 of them at the last joint alone set it free.
    tau[5] += 0.2 * 0.30;
    arm.advance(&tau, 0.1, 100).unwrap();
    assert!(arm.q()[5] > Q[5]);
}

#[test]
fn a_step_allocates_nothing() {
    let model = puma560::model();
    let arm = ArmSimulator::new(&model, Effects::ALL, loaded(&model), &Q, &[0.0; 6]);
    let mut arm = arm.unwrap();
    let report = measure(|| {
        for tick in 0..200 {
            let push = 40.0 * (0.1 * f64::from(tick)).sin();
            assert!(arm.advance(&[push; 6], 1e-3, 2).is_ok());
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}
