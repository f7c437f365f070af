//! Robots that cannot be simulated are refused by name.

use puma_dyn::nalgebra::Matrix3;
use puma_dyn::robot::{
    HysteresisFriction, Inertial, JointDescription, JointKind, LinkDescription, TanhFriction,
};
use puma_dyn::{Model, RobotDescription, puma560};

const BALL: Inertial = Inertial {
    mass: 1.0,
    centre: [0.1, 0.0, 0.0],
    inertia: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.01]],
};

/// base –shoulder– upper –elbow– lower
fn arm() -> RobotDescription {
    let mut robot = RobotDescription::new("arm");
    robot.links.push(LinkDescription::new("base", None));
    robot.links.push(LinkDescription::new("upper", Some(BALL)));
    robot.links.push(LinkDescription::new("lower", Some(BALL)));
    let joint =
        |name, parent, child| JointDescription::new(name, JointKind::Revolute, parent, child);
    robot.joints.push(joint("shoulder", "base", "upper"));
    robot.joints.push(joint("elbow", "upper", "lower"));
    robot
}

/// The message for an arm after a change; the unchanged one is fine.
fn refusal(change: impl FnOnce(&mut RobotDescription)) -> String {
    let mut robot = arm();
    assert!(Model::new(&robot).is_ok());
    change(&mut robot);
    Model::new(&robot)
        .expect_err("it should be refused")
        .to_string()
}

fn assert_refused(words: &[&str], change: impl FnOnce(&mut RobotDescription)) {
    let message = refusal(change);
    for word in words {
        assert!(
            message.contains(word),
            "`{message}` does not mention `{word}`"
        );
    }
}

#[test]
fn names_that_do_not_fit_together() {
    assert_refused(&["link", "`upper`", "more than once"], |r| {
        r.links[2].name = "upper".into();
    });
    assert_refused(&["joint", "`elbow`"], |r| r.joints[0].name = "elbow".into());
    assert_refused(&["`elbow`", "parent", "`uper`"], |r| {
        r.joints[1].parent = "uper".into();
    });
    assert_refused(&["`elbow`", "child", "`lowr`"], |r| {
        r.joints[1].child = "lowr".into();
    });
}

#[test]
fn graphs_that_are_not_trees() {
    assert_refused(&["no links"], |r| {
        r.links.clear();
        r.joints.clear();
    });
    assert_refused(&["2 root links", "base", "upper"], |r| {
        r.joints.remove(0);
    });
    assert_refused(&["`upper`", "`shoulder`", "`elbow`"], |r| {
        r.joints[1].child = "upper".into();
    });
    // upper and lower carry each other; base stands alone.
    assert_refused(&["loop", "`upper`"], |r| {
        r.joints[0].parent = "lower".into();
    });
    assert_refused(&["loop"], |r| {
        let close = JointDescription::new("close", JointKind::Revolute, "lower", "base");
        r.joints.push(close);
    });
}

#[test]
fn geometry_that_is_none() {
    assert_refused(&["`elbow`", "axis is zero"], |r| {
        r.joints[1].axis = [0.0; 3];
    });
    assert_refused(&["`elbow`", "axis is NaN"], |r| {
        r.joints[1].axis[1] = f64::NAN;
    });
    assert_refused(&["`elbow`", "origin is inf"], |r| {
        r.joints[1].origin.translation.x = f64::INFINITY;
    });
    assert_refused(&["`elbow`", "not a rotation"], |r| {
        r.joints[1].origin.rotation = Matrix3::from_diagonal_element(1.1);
    });
    // A reflection is orthonormal, too.
    assert_refused(&["`elbow`", "not a rotation"], |r| {
        r.joints[1].origin.rotation = -Matrix3::identity();
    });
    assert_refused(&["gravity is NaN"], |r| r.gravity[2] = f64::NAN);
}

#[test]
fn masses_that_are_none() {
    let upper = |change: fn(&mut Inertial)| {
        move |r: &mut RobotDescription| change(r.links[1].inertial.as_mut().unwrap())
    };
    assert_refused(&["`upper`", "mass is -1"], upper(|i| i.mass = -1.0));
    assert_refused(&["`upper`", "mass is NaN"], upper(|i| i.mass = f64::NAN));
    assert_refused(
        &["`upper`", "centre of mass is inf"],
        upper(|i| i.centre[0] = f64::INFINITY),
    );
    assert_refused(
        &["`upper`", "not symmetric"],
        upper(|i| i.inertia[0][1] = 0.001),
    );
    assert_refused(&["`elbow`", "nothing beyond it"], |r| {
        r.links[2].inertial = None;
    });
}

#[test]
fn a_massless_link_may_carry_others() {
    let mut robot = arm();
    robot.links[1].inertial = None;
    assert!(Model::new(&robot).is_ok());
}

#[test]
fn drives_that_are_none() {
    assert_refused(&["`elbow`", "rotor inertia", "gear ratio of zero"], |r| {
        r.joints[1].drive.gear_ratio = 0.0;
        r.joints[1].drive.rotor_inertia = 1e-4;
    });
    assert_refused(
        &["`elbow`", "negative speed is 0.1", "zero or negative"],
        |r| {
            r.joints[1].drive.coulomb_motor_negative = 0.1;
        },
    );
    assert_refused(&["`elbow`", "viscous", "-1"], |r| {
        r.joints[1].drive.viscous_motor = -1.0;
    });
    assert_refused(&["`elbow`", "gear ratio is NaN"], |r| {
        r.joints[1].drive.gear_ratio = f64::NAN;
    });
}

#[test]
fn smooth_friction_without_width_or_length() {
    assert_refused(&["`elbow`", "width of tanh friction is 0"], |r| {
        r.joints[1].smooth_friction.tanh = vec![TanhFriction {
            width: 0.0,
            torque: 1.0,
        }];
    });
    assert_refused(&["`elbow`", "length of hysteresis is -1"], |r| {
        r.joints[1].smooth_friction.hysteresis = vec![HysteresisFriction {
            length: -1.0,
            torque: 1.0,
        }];
    });
    assert_refused(&["`elbow`", "viscous friction of the load is NaN"], |r| {
        r.joints[1].smooth_friction.load_viscous = f64::NAN;
    });
}

#[test]
fn an_impossible_inertia_is_a_warning_and_strictly_an_error() {
    let mut robot = arm();
    robot.links[2].inertial = Some(Inertial {
        inertia: [[0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, 0.03]],
        ..BALL
    });
    let model = Model::new(&robot).unwrap();
    let [warning] = model.physical_warnings() else {
        panic!("{:?}", model.physical_warnings())
    };
    assert_eq!(warning.link, "lower");
    let message = model.check_physical().unwrap_err().to_string();
    assert!(
        message.contains("`lower`") && message.contains("triangle"),
        "{message}"
    );
    assert!(Model::new(&arm()).unwrap().check_physical().is_ok());
}

#[test]
fn frames_of_links_behind_fixed_joints_keep_their_names() {
    let mut robot = arm();
    robot.links.push(LinkDescription::new("tool", None));
    robot.joints.push(JointDescription {
        origin: puma_dyn::Pose::from_xyz_rpy([0.0, 0.0, 0.25], [0.0; 3]),
        ..JointDescription::new("flange", JointKind::Fixed, "lower", "tool")
    });
    let model = Model::new(&robot).unwrap();
    assert_eq!(model.n_joints(), 2);
    let tool = model.frame_idx("tool").unwrap();
    let height = puma_dyn::forward_kinematics(&model, tool, &[0.3, 0.4])
        .translation
        .z;
    assert!((height - 0.25).abs() < 1e-15, "{height}");
    assert_eq!(model.frame_idx("flange"), None);
}

#[test]
#[should_panic(expected = "q has 5 numbers, not 6")]
fn a_short_slice_is_a_panic_that_says_so() {
    let model = puma560::model();
    let frame = model.frame_idx(puma560::LAST_LINK).unwrap();
    let _ = puma_dyn::forward_kinematics(&model, frame, &[0.0; 5]);
}
