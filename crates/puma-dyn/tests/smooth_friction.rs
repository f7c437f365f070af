//! Friction that is smooth, remembers and grows with the load: what a sidecar states, and what follows from it.

use std::collections::BTreeMap;

use allocation_counter::measure;
use puma_dyn::dynamics::{Hysteresis, rnea_with_hysteresis, torque_terms_with_hysteresis};
use puma_dyn::robot::{
    HysteresisFriction, JointKeys, LoadHysteresisFriction, SmoothFriction, TanhFriction,
};
use puma_dyn::{
    Context, DynError, Effects, Friction, Model, RobotDescription, Sidecar, TorqueTerms, Workspace,
    aba, parse_urdf, puma560, rnea, torque_terms,
};

use crate::random_tree::{Joints, cases};

/// Friction that is not nearly all of a load at the speeds of the random robots, below 1.5 rad/s.
fn friction(joint: usize) -> SmoothFriction {
    let number = joint as f64;
    SmoothFriction {
        offset: 0.2 * number,
        tanh: vec![TanhFriction {
            width: 0.3,
            torque: 1.0 + number,
        }],
        hysteresis: vec![HysteresisFriction {
            length: 1e-3,
            torque: 0.5,
        }],
        load_hysteresis: vec![LoadHysteresisFriction {
            length: 2e-3,
            coefficient: 0.15 + 0.02 * number,
        }],
        load_viscous: 0.2,
    }
}

fn with_friction(description: &RobotDescription) -> Model {
    let mut robot = description.clone();
    for (idx, joint) in robot.joints.iter_mut().enumerate() {
        joint.smooth_friction = friction(idx % 7);
    }
    Model::new(&robot).expect("valid")
}

#[test]
fn forward_dynamics_inverts_friction_of_the_load() {
    for mut case in cases(Joints::Mixed) {
        let model = with_friction(&case.description);
        let (workspace, context) = (&mut case.workspace, &case.context);
        let n = model.n_joints();
        let (mut tau, mut qdd) = (vec![0.0; n], vec![0.0; n]);
        let (q, qd) = (&case.q, &case.qd);
        for effects in [
            Effects::ALL,
            Effects {
                rotor_inertia: false,
                ..Effects::ALL
            },
        ] {
            rnea(
                &model, workspace, effects, context, q, qd, &case.qdd, &mut tau,
            );
            aba(&model, workspace, effects, context, q, qd, &tau, &mut qdd).unwrap();
            let scale = case
                .qdd
                .iter()
                .fold(1.0, |scale: f64, a| scale.max(a.abs()));
            for (found, expected) in qdd.iter().zip(&case.qdd) {
                // As for the identity without this friction, through a badly conditioned inertia matrix.
                assert!(
                    (found - expected).abs() < 1e-7 * scale,
                    "seed {}: {found} {expected}",
                    case.seed
                );
            }
        }
    }
}

#[test]
fn terms_add_up_and_lasting_motion_is_the_limit_of_memory() {
    for mut case in cases(Joints::Mixed) {
        let model = with_friction(&case.description);
        let (ws, context) = (&mut case.workspace, &case.context);
        let n = model.n_joints();
        let (mut tau, mut lasting) = (vec![0.0; n], vec![0.0; n]);
        let mut terms = TorqueTerms::new(&model);
        let (q, qd, qdd) = (&case.q, &case.qd, &case.qdd);
        let mut past = Hysteresis::new(&model);
        let all = Effects::ALL;
        past.advance(qd, 1e3);
        rnea_with_hysteresis(&model, ws, all, context, &past, q, qd, qdd, &mut tau);
        rnea(&model, ws, all, context, q, qd, qdd, &mut lasting);
        let mut of_past = TorqueTerms::new(&model);
        torque_terms(&model, ws, all, context, q, qd, qdd, &mut terms);
        torque_terms_with_hysteresis(&model, ws, all, context, &past, q, qd, qdd, &mut of_past);
        for joint in 0..n {
            let tolerance = 1e-11 * (100.0 + tau[joint].abs());
            for other in [lasting[joint], terms.total(joint), of_past.total(joint)] {
                assert!((tau[joint] - other).abs() < tolerance, "seed {}", case.seed);
            }
        }
    }
}

#[test]
fn a_joint_that_locks_itself_has_no_forward_dynamics() {
    let mut robot = puma560::description();
    robot.joints[1].smooth_friction.load_viscous = 0.5;
    let model = Model::new(&robot).unwrap();
    let (mut ws, qd) = (Workspace::new(&model), [0.0, 2.5, 0.0, 0.0, 0.0, 0.0]);
    let (empty, zero, mut qdd) = (Context::empty(), [0.0; 6], [0.0; 6]);
    let refused = aba(
        &model,
        &mut ws,
        Effects::ALL,
        &empty,
        &zero,
        &qd,
        &zero,
        &mut qdd,
    );
    let expected = DynError::LoadFriction {
        joint: "joint2".to_owned(),
        share: 1.25,
    };
    assert_eq!(refused, Err(expected));
}

#[test]
fn nothing_allocates() {
    let model = with_friction(&puma560::description());
    let (mut ws, empty) = (Workspace::new(&model), Context::empty());
    let mut past = Hysteresis::new(&model);
    let (x, mut tau, mut qdd) = ([0.3; 6], [0.0; 6], [0.0; 6]);
    let all = Effects::ALL;
    let report = measure(|| {
        past.advance(&x, 1e-3);
        past.travel(&x, &tau);
        rnea_with_hysteresis(&model, &mut ws, all, &empty, &past, &x, &x, &x, &mut tau);
        assert!(aba(&model, &mut ws, all, &empty, &x, &x, &tau, &mut qdd).is_ok());
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}

const HINGE: &str = r#"<robot name="pendulum">
  <link name="base"/>
  <link name="rod"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
    <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.01"/></inertial></link>
  <joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint>
</robot>"#;

const TABLE: &str = "[joint.hinge]
offset = 0.3
tanh = [{ width = 0.02, torque = 1.5 }, { width = 0.5, torque = -0.25 }]
hysteresis = [{ length = 0.0005, torque = 2.0 }]
load_hysteresis = [{ length = 0.001, coefficient = 0.05 }]
load_viscous = 0.08
";

#[test]
fn a_sidecar_states_every_term() {
    let sidecar = Sidecar::parse("arm.toml", TABLE).unwrap();
    let loaded = parse_urdf("arm.urdf", HINGE, Some(&sidecar)).unwrap();
    let expected = SmoothFriction {
        offset: 0.3,
        tanh: vec![
            TanhFriction {
                width: 0.02,
                torque: 1.5,
            },
            TanhFriction {
                width: 0.5,
                torque: -0.25,
            },
        ],
        hysteresis: vec![HysteresisFriction {
            length: 0.0005,
            torque: 2.0,
        }],
        load_hysteresis: vec![LoadHysteresisFriction {
            length: 0.001,
            coefficient: 0.05,
        }],
        load_viscous: 0.08,
    };
    assert_eq!(loaded.description.joints[0].smooth_friction, expected);
    assert!(loaded.model.has_hysteresis());

    let again = Sidecar::parse("again.toml", &sidecar.to_toml().unwrap()).unwrap();
    let again = parse_urdf("arm.urdf", HINGE, Some(&again)).unwrap();
    assert_eq!(again.model, loaded.model);
}

#[test]
fn values_become_a_sidecar_that_reads_back_to_the_bit() {
    // Numbers without a short decimal form.
    let third = 1.0 / 3.0;
    let keys = JointKeys {
        rotor_inertia: Some(2e-4 * third),
        gear_ratio: Some(-100.0 * third),
        viscous_joint: Some(third),
        coulomb_motor_positive: Some(0.1 + 0.2),
        coulomb_motor_negative: Some(-1e-300),
        offset: Some(-third),
        hysteresis: vec![HysteresisFriction {
            length: 1e-3 * third,
            torque: 1e17 * third,
        }],
        ..JointKeys::default()
    };
    let joints = BTreeMap::from([("a joint \"2\".x".to_owned(), keys)]);
    let sidecar = Sidecar::new("made.toml", Some(Friction::Toolbox2008), joints).unwrap();
    let text = sidecar.to_toml().unwrap();
    let again =
        Sidecar::parse("made.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    assert_eq!(again, sidecar, "{text}");
}

#[test]
fn wrong_entries_are_refused_with_joint_key_and_number() {
    let cases = [
        (
            "= 0.02",
            "= 0",
            "arm.toml: joint `hinge`: tanh entry 1: width = 0, must be positive",
        ),
        (
            "= -0.25",
            "= nan",
            "tanh entry 2: torque = NaN, must be finite",
        ),
        (
            "= 0.0005",
            "= -1",
            "hysteresis entry 1: length = -1, must be positive",
        ),
        (
            "= 0.05",
            "= inf",
            "load_hysteresis entry 1: coefficient = inf, must be finite",
        ),
        ("= 0.08", "= nan", "load_viscous = NaN, must be finite"),
        ("= 0.3", "= inf", "offset = inf, must be finite"),
        (
            "width = 0.5",
            "length = 0.5",
            "arm.toml:3:43: unknown field `length`",
        ),
    ];
    for (from, to, expected) in cases {
        let text = TABLE.replacen(from, to, 1);
        assert_ne!(text, TABLE);
        let message = Sidecar::parse("arm.toml", &text).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}
