//! The sidecar TOML: what it says, what it replaces, and what it refuses with file, joint and key.

use puma_dyn::robot::{Drive, JointDescription, JointKind, LinkDescription};
use puma_dyn::{DynError, Friction, RobotDescription, Sidecar, Warning};

/// A robot with a hinge that states friction of its own, a slide that does not, and a bolt.
fn robot() -> RobotDescription {
    let mut robot = RobotDescription::new("arm");
    let joints = [
        ("hinge", JointKind::Revolute),
        ("slide", JointKind::Prismatic),
    ];
    robot.links.push(LinkDescription::new("base", None));
    for (name, kind) in joints.into_iter().chain([("bolt", JointKind::Fixed)]) {
        robot.links.push(LinkDescription::new(name, None));
        robot
            .joints
            .push(JointDescription::new(name, kind, "base", name));
    }
    robot.joints[0].drive = Drive {
        viscous_joint: 0.7,
        coulomb_joint: 0.2,
        ..Drive::NONE
    };
    robot
}

fn apply(text: &str) -> (RobotDescription, Vec<Warning>) {
    let mut robot = robot();
    let sidecar = Sidecar::parse("arm.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let warnings = sidecar
        .apply(&mut robot)
        .unwrap_or_else(|error| panic!("{error}"));
    (robot, warnings)
}

const MOTOR: &str = "[joint.hinge]
rotor_inertia = 2e-4
gear_ratio = -60
viscous_motor = 1e-3
coulomb_motor_positive = 0.4
coulomb_motor_negative = -0.3
";

#[test]
fn motor_side_keys_replace_the_urdf_friction_with_a_warning_each() {
    let (robot, warnings) = apply(MOTOR);
    let expected = Drive {
        rotor_inertia: 2e-4,
        gear_ratio: -60.0,
        viscous_motor: 1e-3,
        coulomb_motor_positive: 0.4,
        coulomb_motor_negative: -0.3,
        viscous_joint: 0.0,
        coulomb_joint: 0.0,
    };
    assert_eq!(robot.joints[0].drive, expected);
    let replaced = |quantity, urdf, key| Warning::FrictionReplaced {
        joint: "hinge".to_owned(),
        quantity,
        urdf,
        key,
    };
    let expected = [
        replaced("damping", 0.7, "viscous_motor"),
        replaced("friction", 0.2, "coulomb_motor_positive"),
    ];
    assert_eq!(warnings, expected);
}

#[test]
fn what_the_sidecar_does_not_state_stays_as_the_urdf_states_it() {
    let (robot, warnings) = apply("[joint.hinge]\nrotor_inertia = 2e-4\ngear_ratio = 60");
    let drive = &robot.joints[0].drive;
    assert!((drive.viscous_joint - 0.7).abs() <= 0.0);
    assert!((drive.coulomb_joint - 0.2).abs() <= 0.0);
    assert!((drive.rotor_inertia - 2e-4).abs() <= 0.0);
    assert_eq!(warnings, []);
    assert_eq!(apply("").0, self::robot());
}

#[test]
fn joint_side_friction_needs_no_gear() {
    let (robot, warnings) = apply("[joint.slide]\nviscous_joint = 3\ncoulomb_joint = 1.5");
    let expected = Drive {
        viscous_joint: 3.0,
        coulomb_joint: 1.5,
        ..Drive::NONE
    };
    assert_eq!(robot.joints[1].drive, expected);
    assert_eq!(warnings, []);
}

#[test]
fn the_friction_convention_is_one_of_three_or_unstated() {
    let cases = [
        ("modern", Friction::Modern),
        ("toolbox-2008", Friction::Toolbox2008),
        ("none", Friction::None),
    ];
    for (name, friction) in cases {
        let text = format!("friction_convention = \"{name}\"");
        let sidecar = Sidecar::parse("arm.toml", &text).expect("valid");
        assert_eq!(sidecar.friction(), Some(friction));
    }
    assert_eq!(
        Sidecar::parse("arm.toml", MOTOR).expect("valid").friction(),
        None
    );
}

#[test]
fn wrong_values_are_refused_with_file_joint_and_key() {
    let cases = [
        (
            "rotor_inertia = 2e-4",
            "rotor_inertia = -2e-4",
            "rotor_inertia = -0.0002, must not be negative",
        ),
        (
            "rotor_inertia = 2e-4",
            "rotor_inertia = nan",
            "rotor_inertia = NaN, must be finite",
        ),
        (
            "gear_ratio = -60",
            "gear_ratio = 0",
            "gear_ratio = 0, must not be zero",
        ),
        (
            "gear_ratio = -60",
            "gear_ratio = inf",
            "gear_ratio = inf, must be finite",
        ),
        (
            "gear_ratio = -60\n",
            "",
            "rotor_inertia is on the motor's side and needs `gear_ratio`",
        ),
        (
            "= 1e-3",
            "= -1e-3",
            "viscous_motor = -0.001, must not be negative",
        ),
        (
            "= 0.4",
            "= -0.4",
            "coulomb_motor_positive = -0.4, must not be negative",
        ),
        (
            "= -0.3",
            "= 0.3",
            "coulomb_motor_negative = 0.3, must not be positive",
        ),
        (
            "coulomb_motor_negative = -0.3\n",
            "",
            "coulomb_motor_negative is missing",
        ),
        (
            "coulomb_motor_positive = 0.4\n",
            "",
            "coulomb_motor_positive is missing",
        ),
    ];
    for (old, new, message) in cases {
        assert_eq!(MOTOR.matches(old).count(), 1, "{old}");
        let error = Sidecar::parse("arm.toml", &MOTOR.replace(old, new)).expect_err(message);
        let expected = format!("arm.toml: joint `hinge`: {message}");
        assert!(error.to_string().starts_with(&expected), "{error}");
        assert!(matches!(error, DynError::Sidecar { .. }));
    }
}

#[test]
fn unknown_keys_and_words_for_numbers_are_refused_with_line_and_column() {
    let cases = [
        (
            MOTOR.replace("viscous_motor", "viscous"),
            "arm.toml:4:1: unknown field `viscous`",
        ),
        (
            MOTOR.replace("-60", "\"sixty\""),
            "arm.toml:3:14: invalid type: string",
        ),
        (
            MOTOR.replace("[joint.hinge]", "[joints.hinge]"),
            "arm.toml:1:2: unknown field `joints`",
        ),
        (MOTOR.replace("-60", "-60 :1"), "arm.toml:3:"),
        (
            "friction_convention = \"sticky\"".to_owned(),
            "arm.toml:1:23: unknown variant `sticky`",
        ),
    ];
    for (text, message) in cases {
        let error = Sidecar::parse("arm.toml", &text)
            .expect_err(message)
            .to_string();
        assert!(error.starts_with(message), "{error}");
        assert!(!error.contains('\n'), "not one line: {error}");
    }
}

#[test]
fn a_joint_that_does_not_exist_or_does_not_move_is_refused_by_name() {
    let cases = [
        (
            "[joint.hing]",
            "arm.toml: joint `hing`: the robot has no such joint; it has hinge, slide, bolt",
        ),
        (
            "[joint.bolt]\ncoulomb_joint = 1",
            "arm.toml: joint `bolt`: the joint is fixed",
        ),
    ];
    for (text, message) in cases {
        let mut robot = robot();
        let sidecar = Sidecar::parse("arm.toml", text).expect("valid without the robot");
        let error = sidecar.apply(&mut robot).expect_err(message);
        assert_eq!(error.to_string(), message);
        assert_eq!(robot, self::robot());
    }
}

#[test]
fn a_locked_joint_becomes_a_fixed_one_at_its_position() {
    let (robot, _) = apply("[joint.hinge]\nlocked_at = 0.5\n[joint.slide]\nlocked_at = -0.2");
    let [hinge, slide, _] = &robot.joints[..] else {
        panic!("three joints");
    };
    assert_eq!([hinge.kind, slide.kind], [JointKind::Fixed; 2]);
    // About and along z: cos 0.5 on the diagonal, −0.2 m along the axis.
    assert!((hinge.origin.rotation[(0, 0)] - 0.5_f64.cos()).abs() <= f64::EPSILON);
    assert!((slide.origin.translation.z + 0.2).abs() <= f64::EPSILON);
    assert_eq!(hinge.drive, Drive::NONE);
    let error = Sidecar::parse("arm.toml", "[joint.hinge]\nlocked_at = nan").expect_err("NaN");
    assert!(
        error
            .to_string()
            .contains("locked_at = NaN, must be finite"),
        "{error}"
    );
}
