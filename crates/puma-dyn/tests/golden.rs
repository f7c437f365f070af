//! The PUMA 560 against numbers printed by the Robotics Toolbox's own tests.
//!
//! # Source
//! The tests that come with Corke's Robotics Toolboxes (MATLAB and Python), for their PUMA 560 model.
//! Each number is compared to half a unit of its last printed digit.

use std::f64::consts::{FRAC_PI_4, PI};

use puma_dyn::{
    Context, Effects, Friction, Model, Payload, Workspace, crba, forward_kinematics, puma560, rnea,
};

/// The toolbox's "nominal" pose.
const Q_N: [f64; 6] = [0.0, FRAC_PI_4, PI, 0.0, FRAC_PI_4, 0.0];
const TOOLBOX_2008: Effects = Effects {
    friction: Friction::Toolbox2008,
    rotor_inertia: true,
};

fn torques(model: &Model, effects: Effects, q: [f64; 6], qd: [f64; 6], qdd: [f64; 6]) -> [f64; 6] {
    let (mut workspace, mut tau) = (Workspace::new(model), [0.0; 6]);
    rnea(
        model,
        &mut workspace,
        effects,
        &Context::empty(),
        &q,
        &qd,
        &qdd,
        &mut tau,
    );
    tau
}

/// Half a unit of the last digit of a printed number; a bare `0` was printed with four digits.
fn half_digit(printed: &str) -> f64 {
    let digits = printed
        .split_once('.')
        .map_or(4, |(_, digits)| digits.len());
    0.500_000_1 * 10.0_f64.powi(-i32::try_from(digits).expect("a few digits"))
}

fn assert_printed(values: &[f64], printed: &str) {
    let printed: Vec<&str> = printed.split(", ").collect();
    assert_eq!(values.len(), printed.len());
    for (value, text) in values.iter().zip(printed) {
        let expected: f64 = text.parse().expect("a number");
        assert!(
            (value - expected).abs() <= half_digit(text),
            "{value} was printed as {text}"
        );
    }
}

#[test]
fn torques_at_the_nominal_pose() {
    let model = puma560::model();
    for (qd, qdd, printed) in [
        (0.0, 0.0, "0, 31.6399, 6.0351, 0, 0.0283, 0"),
        (
            0.0,
            1.0,
            "3.35311, 36.0025, 7.42596, 0.190043, 0.203441, 0.194133",
        ),
        (
            1.0,
            1.0,
            "32.4952, 60.867, 17.7436, 1.45452, 1.29911, 0.713781",
        ),
        (
            1.0,
            0.0,
            "29.1421, 56.5044, 16.3528, 1.26448, 1.12392, 0.519648",
        ),
    ] {
        assert_printed(
            &torques(&model, Effects::ALL, Q_N, [qd; 6], [qdd; 6]),
            printed,
        );
    }
}

#[test]
fn torques_without_gravity() {
    let model = puma560::model().with_gravity([0.0; 3]);
    let tau = torques(&model, Effects::ALL, Q_N, [1.0; 6], [1.0; 6]);
    assert_printed(
        &tau,
        "32.4952, 29.2271, 11.7085, 1.45452, 1.27086, 0.713781",
    );
}

#[test]
fn torques_with_some_joints_at_rest() {
    let q = [0.0, FRAC_PI_4, -PI, 1.0, FRAC_PI_4, 0.0];
    let rates = [0.0, 1.0, 0.0, 0.0, 2.0, 0.0];
    let tau = torques(&puma560::model(), Effects::ALL, q, rates, rates);
    assert_printed(&tau, "-0.9748, 59.1306, 5.9889, -0.0108, 1.8872, 0.0001");
}

#[test]
fn the_friction_of_2008_helps_the_joints_with_negative_gear_ratio() {
    let tau = torques(&puma560::model(), TOOLBOX_2008, Q_N, [1.0; 6], [0.0; 6]);
    assert_printed(&tau, "-26.2151, 47.0956, -1.8802, 0.8582, 0.7026, 0.3066");
}

#[test]
fn inertia_matrix_at_the_nominal_pose() {
    let model = puma560::model();
    let (mut workspace, mut matrix) = (Workspace::new(&model), [0.0; 36]);
    crba(
        &model,
        &mut workspace,
        Effects::ALL,
        &Context::empty(),
        &Q_N,
        &mut matrix,
    );
    let diagonal: [f64; 6] = std::array::from_fn(|i| matrix[7 * i]);
    assert_printed(&diagonal, "3.6594, 4.4137, 0.9378, 0.1925, 0.1713, 0.1941");
    assert_printed(
        &[matrix[1], matrix[2], matrix[8]],
        "-0.4044, 0.1006, 0.3509",
    );
}

#[test]
fn the_last_frame_at_zero_angles() {
    let model = puma560::model();
    let flange = model.frame_idx(puma560::LAST_LINK).unwrap();
    let pose = forward_kinematics(&model, flange, &[0.0; 6]);
    assert_printed(pose.translation.as_slice(), "0.4521, -0.15005, 0.4318");
    for (entry, expected) in pose
        .rotation
        .iter()
        .zip([1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0])
    {
        // cos(π/2) = 6e-17, twice.
        assert!((entry - expected).abs() < 4.0 * f64::EPSILON, "{pose:?}");
    }
}

/// The pose of the toolbox's payload example.
fn holding_pose() -> [f64; 6] {
    [45.0_f64, 70.0, -100.0, 60.0, 25.0, -140.0].map(f64::to_radians)
}

#[test]
fn holding_still_without_load() {
    let tau = torques(
        &puma560::model(),
        Effects::ALL,
        holding_pose(),
        [0.0; 6],
        [0.0; 6],
    );
    assert_printed(
        &tau,
        "0, 16.3678159, 4.59518490, -0.00517024, -0.00393904, 0",
    );
}

#[test]
fn a_point_load_adds_its_weight_times_its_lever() {
    // τ_i = ẑ_i · (p − p_i) × m g upwards, with the load's place from forward kinematics alone.
    let model = puma560::model();
    let q = holding_pose();
    let payload = Payload::new(2.5, [0.0, 0.0, 0.1], [0.0; 6]).unwrap();
    let flange = model.frame_idx(puma560::LAST_LINK).unwrap();
    let context = model.attach(flange, &payload).unwrap().into();
    let (mut workspace, mut tau) = (Workspace::new(&model), [0.0; 6]);
    let zero = [0.0; 6];
    rnea(
        &model,
        &mut workspace,
        Effects::ALL,
        &context,
        &q,
        &zero,
        &zero,
        &mut tau,
    );
    let unloaded = torques(&model, Effects::ALL, q, zero, zero);

    let height = |q: &[f64]| {
        let pose = forward_kinematics(&model, flange, q);
        pose.transform_point(&[0.0, 0.0, 0.1].into()).z
    };
    for joint in 0..6 {
        // Height is a + b sin(q + φ) in each joint, so ±90° give its slope exactly.
        let (mut before, mut after) = (q, q);
        before[joint] -= PI / 2.0;
        after[joint] += PI / 2.0;
        let lever = 0.5 * (height(&after) - height(&before));
        let (added, expected) = (tau[joint] - unloaded[joint], 2.5 * 9.81 * lever);
        assert!(
            (added - expected).abs() < 100.0 * f64::EPSILON * 30.0,
            "{added} {expected}"
        );
    }
}
