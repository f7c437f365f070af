//! A payload in a context is the same as a link welded to the arm.

use proptest::prelude::*;
use puma_dyn::dynamics::{inertial_parameters, potential_energy};
use puma_dyn::nalgebra::Matrix3;
use puma_dyn::robot::{Inertial, JointDescription, JointKind, LinkDescription};
use puma_dyn::spatial::rotation_from_rpy;
use puma_dyn::{Context, Effects, Model, Payload, Workspace, crba, puma560, rnea};

use crate::random_tree::{Case, Joints, cases};

/// The arm with its payload as a link of its own.
fn welded(case: &Case, inertial: Inertial) -> Model {
    let mut robot = case.description.clone();
    robot
        .links
        .push(LinkDescription::new("payload", Some(inertial)));
    let (parent, kind) = (&case.loaded_link, JointKind::Fixed);
    robot
        .joints
        .push(JointDescription::new("weld", kind, parent, "payload"));
    Model::new(&robot).expect("still a valid robot")
}

const LOAD: Inertial = Inertial {
    mass: 1.7,
    centre: [0.05, -0.1, 0.2],
    inertia: [
        [0.03, 0.004, -0.002],
        [0.004, 0.025, 0.003],
        [-0.002, 0.003, 0.02],
    ],
};

fn load() -> Payload {
    Payload::new(
        LOAD.mass,
        LOAD.centre,
        [0.03, 0.025, 0.02, 0.004, -0.002, 0.003],
    )
    .expect("a possible payload")
}

#[test]
fn a_payload_equals_a_welded_link_in_every_algorithm() {
    for mut case in cases(Joints::Mixed) {
        let welded = welded(&case, LOAD);
        let frame = case.model.frame_idx(&case.loaded_link).unwrap();
        let context = Context::from(case.model.attach(frame, &load()).unwrap());
        let Case {
            model,
            workspace,
            q,
            qd,
            qdd,
            ..
        } = &mut case;
        let mut all = |model: &Model, context: &Context| {
            let n = model.n_joints();
            let (mut tau, mut matrix) = (vec![0.0; n], vec![0.0; n * n]);
            rnea(
                model,
                workspace,
                Effects::ALL,
                context,
                q,
                qd,
                qdd,
                &mut tau,
            );
            crba(model, workspace, Effects::ALL, context, q, &mut matrix);
            tau.push(potential_energy(model, workspace, context, q));
            tau.extend(matrix);
            tau.extend(inertial_parameters(model, context));
            tau
        };
        let (attached, merged) = (all(model, &context), all(&welded, &Context::empty()));
        let scale = merged
            .iter()
            .fold(0.0_f64, |scale, value| scale.max(value.abs()));
        for (attached, merged) in attached.iter().zip(&merged) {
            let error = (attached - merged).abs();
            assert!(
                error < 1000.0 * f64::EPSILON * scale,
                "{}: {attached} {merged}",
                case.seed
            );
        }
    }
}

#[test]
fn two_payloads_add_and_replacing_one_takes_it_off() {
    let model = puma560::model();
    let flange = model.frame_idx(puma560::LAST_LINK).unwrap();
    let forearm = model.frame_idx("link3").unwrap();
    let (light, heavy) = (Payload::new(0.5, [0.1; 3], [0.0; 6]).unwrap(), load());
    let on = |frame, payload| model.attach(frame, payload).unwrap();
    let mut workspace = Workspace::new(&model);
    let mut torques = |context: &Context| {
        let (mut tau, x) = ([0.0; 6], [0.4, -0.3, 0.7, 1.1, -0.6, 0.2]);
        rnea(
            &model,
            &mut workspace,
            Effects::ALL,
            context,
            &x,
            &x,
            &x,
            &mut tau,
        );
        tau
    };
    let none = torques(&Context::empty());
    let first = torques(&on(flange, &light).into());
    let second = torques(&on(forearm, &heavy).into());
    let mut context = Context::new([on(flange, &light), on(forearm, &heavy)]);
    let both = torques(&context);
    for joint in 0..6 {
        let sum = first[joint] + second[joint] - none[joint];
        assert!(
            (both[joint] - sum).abs() < 1e-13 * 100.0,
            "{} {sum}",
            both[joint]
        );
    }
    context.replace(
        1,
        on(flange, &Payload::new(0.0, [0.0; 3], [0.0; 6]).unwrap()),
    );
    let without = torques(&context);
    for joint in 0..6 {
        assert!(
            (without[joint] - first[joint]).abs() < 1e-13,
            "{without:?} {first:?}"
        );
    }
}

proptest! {
    /// Turning a payload's tensor by hand and letting `cuboid` turn it are the same.
    #[test]
    fn a_cuboid_is_its_diagonal_tensor_turned_by_roll_pitch_yaw(
        mass in 0.01..20.0_f64,
        size in prop::array::uniform3(0.01..1.0_f64),
        rpy in prop::array::uniform3(-3.2..3.2_f64),
    ) {
        let cuboid = Payload::cuboid(mass, size, [0.0; 3], rpy).unwrap();
        let [x, y, z] = size.map(|edge| edge * edge);
        let diagonal = Matrix3::from_diagonal(&[y + z, x + z, x + y].into()) * (mass / 12.0);
        let r = rotation_from_rpy(rpy);
        let t = r * diagonal * r.transpose();
        let entries = [t[(0, 0)], t[(1, 1)], t[(2, 2)], t[(0, 1)], t[(0, 2)], t[(1, 2)]];
        let by_hand = Payload::new(mass, [0.0; 3], entries).unwrap();

        let model = puma560::model();
        let flange = model.frame_idx(puma560::LAST_LINK).unwrap();
        let parameters = |payload: &Payload| {
            inertial_parameters(&model, &model.attach(flange, payload).unwrap().into())
        };
        for (left, right) in parameters(&cuboid).iter().zip(parameters(&by_hand)) {
            prop_assert!((left - right).abs() <= 64.0 * f64::EPSILON * mass, "{left} {right}");
        }
    }
}
