//! Inverse kinematics of the PUMA 560 against the product of its Denavit–Hartenberg transforms.

use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;
use puma_dyn::chapter::{Arm, Branch, Elbow, Wrist, inverse_kinematics};
use puma_dyn::nalgebra::Vector3;
use puma_dyn::spatial::DhLink;
use puma_dyn::{DynError, Pose};

/// (alpha, a, d) of Corke's table (8/95), rad and m.
const TABLE: [(f64, f64, f64); 6] = [
    (FRAC_PI_2, 0.0, 0.0),
    (0.0, 0.4318, 0.0),
    (-FRAC_PI_2, 0.0203, 0.15005),
    (FRAC_PI_2, 0.0, 0.4318),
    (-FRAC_PI_2, 0.0, 0.0),
    (0.0, 0.0, 0.0),
];

/// Pose of frame 6 in frame 0.
fn forward(q: &[f64; 6]) -> Pose {
    TABLE
        .iter()
        .zip(q)
        .fold(Pose::identity(), |pose, (&(alpha, a, d), &angle)| {
            pose.compose(&DhLink { alpha, a, d }.transform(angle))
        })
}

/// Largest difference of two poses, m or dimensionless.
fn distance(a: &Pose, b: &Pose) -> f64 {
    (a.rotation - b.rotation)
        .amax()
        .max((a.translation - b.translation).amax())
}

/// Angle difference modulo a turn.
fn angle_between(a: f64, b: f64) -> f64 {
    let difference = (a - b).rem_euclid(2.0 * PI);
    difference.min(2.0 * PI - difference)
}

/// Every angle in a turn.
fn any_angles() -> impl Strategy<Value = [f64; 6]> {
    prop::array::uniform6(-PI..PI)
}

proptest! {
    #[test]
    fn every_branch_of_a_reachable_pose_leads_back_to_the_pose(q in any_angles()) {
        let pose = forward(&q);
        for branch in Branch::ALL {
            let angles = inverse_kinematics(&pose, branch).unwrap();
            prop_assert!(angles.iter().all(|angle| (-PI..=PI).contains(angle)), "{angles:?}");
            // A square root next to the stretched arm or the shoulder offset halves the digits of an angle,
            // but not of the pose: its error is second order in the angle there, so a few roundings remain.
            let error = distance(&forward(&angles), &pose);
            prop_assert!(error < 1e-12, "{branch:?} {angles:?}: {error:e}");
        }
    }

    #[test]
    fn the_branch_of_a_joint_vector_gives_the_vector_back(q in any_angles()) {
        // Away from the boundaries between branches, where an angle is the square root of a rounding.
        let psi = q[2] + TABLE[3].2.atan2(TABLE[2].1);
        let wrist = forward(&q).translation;
        prop_assume!(psi.sin().abs() > 0.01 && q[4].sin().abs() > 0.01);
        prop_assume!(wrist.x.hypot(wrist.y) > 0.151);
        let angles = inverse_kinematics(&forward(&q), Branch::of(&q)).unwrap();
        for (found, &expected) in angles.iter().zip(&q) {
            // Roundings of the pose (ε) over the smallest of the sines above, squared for r − d3.
            let error = angle_between(*found, expected);
            prop_assert!(error < 1e-10, "{angles:?} {q:?}: {error:e}");
        }
    }
}

#[test]
fn the_eight_branches_of_a_pose_are_eight_different_answers() {
    let pose = forward(&[0.3, 0.5, -0.9, 0.4, 0.8, -0.2]);
    let answers = Branch::ALL.map(|branch| inverse_kinematics(&pose, branch).unwrap());
    for (i, a) in answers.iter().enumerate() {
        assert_eq!(Branch::of(a), Branch::ALL[i], "{a:?}");
        for b in &answers[..i] {
            let apart = a
                .iter()
                .zip(b)
                .map(|(x, y)| angle_between(*x, *y))
                .fold(0.0, f64::max);
            assert!(apart > 0.1, "{a:?} {b:?}");
        }
    }
}

#[test]
fn elbow_up_is_the_higher_elbow() {
    let pose = forward(&[0.3, 0.5, -0.9, 0.4, 0.8, -0.2]);
    for arm in [Arm::Left, Arm::Right] {
        let height = |elbow| {
            let branch = Branch::new(arm, elbow, Wrist::NoFlip);
            inverse_kinematics(&pose, branch).unwrap()[1].sin()
        };
        assert!(height(Elbow::Up) > height(Elbow::Down), "{arm:?}");
    }
}

#[test]
fn aligned_wrist_axes_put_the_whole_turn_into_joint_six() {
    for q5 in [0.0, PI] {
        let pose = forward(&[0.3, 0.5, -0.9, 0.7, q5, 0.4]);
        for branch in Branch::ALL {
            let angles = inverse_kinematics(&pose, branch).unwrap();
            assert!(
                distance(&forward(&angles), &pose) < 1e-12,
                "{branch:?} {angles:?}"
            );
        }
        let angles =
            inverse_kinematics(&pose, Branch::of(&[0.3, 0.5, -0.9, 0.0, q5, 0.0])).unwrap();
        let turn = if q5 < 1.0 { 0.7 + 0.4 } else { 0.4 - 0.7 };
        // ε-sized entries of the rotation remain at the singularity, so q4 is 0 exactly only up to the threshold.
        assert!(angles[3].abs() < f64::EPSILON, "{angles:?}");
        assert!(angle_between(angles[5], turn) < 1e-14, "{angles:?}");
    }
}

#[test]
fn stretched_arm_is_reachable_though_its_cosine_may_round_above_one() {
    let q3 = -TABLE[3].2.atan2(TABLE[2].1);
    for step in 0..200 {
        let pose = forward(&[0.1, 0.03 * f64::from(step), q3, 0.0, 0.5, 0.0]);
        for branch in Branch::ALL {
            let angles = inverse_kinematics(&pose, branch).unwrap();
            let error = distance(&forward(&angles), &pose);
            assert!(error < 1e-12, "{branch:?} {angles:?}: {error:e}");
        }
    }
}

#[test]
fn a_micrometre_beyond_the_stretched_arm_is_not_reachable() {
    // q3 = −atan2(d4, a3) stretches the arm; the wrist then moves outwards along the forearm.
    let stretched = [0.0, 0.4, -TABLE[3].2.atan2(TABLE[2].1), 0.0, 0.5, 0.0];
    let branch = Branch::new(Arm::Right, Elbow::Up, Wrist::NoFlip);
    let pose = forward(&stretched);
    assert!(inverse_kinematics(&pose, branch).is_ok());
    let mut beyond = pose;
    beyond.translation += 1e-6 * Vector3::new(0.4_f64.cos(), 0.0, 0.4_f64.sin());
    let error = inverse_kinematics(&beyond, branch).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("farther than the stretched arm's 0.8641 m"),
        "{error}"
    );
}

#[test]
fn unreachable_poses_are_named_with_the_reason() {
    let cases = [
        (
            Vector3::new(0.1, 0.1, 0.3),
            "nearer than the shoulder offset of 0.15005 m",
        ),
        (
            Vector3::new(0.0, 0.15005, 0.0),
            "nearer than the folded arm's 0.0005 m",
        ),
        (
            Vector3::new(0.9, 0.0, 0.0),
            "farther than the stretched arm's 0.8641 m",
        ),
        (Vector3::new(f64::NAN, 0.0, 0.0), "position is not finite"),
        (
            Vector3::new(0.5, 0.0, f64::INFINITY),
            "position is not finite",
        ),
    ];
    for (wrist, reason) in cases {
        let pose = Pose::new(Pose::identity().rotation, wrist);
        for branch in Branch::ALL {
            let error = inverse_kinematics(&pose, branch).unwrap_err();
            assert!(matches!(error, DynError::Unreachable { .. }), "{error:?}");
            assert!(error.to_string().contains(reason), "{error}");
        }
    }
    let error = inverse_kinematics(
        &Pose::new(Pose::identity().rotation, cases[2].0),
        Branch::ALL[0],
    );
    assert!(error.unwrap_err().to_string().contains("(0.9, 0, 0)"));
}
