//! Inverse dynamics the slow, plain way: Newton's and Euler's laws for every link in world axes.
//!
//! It knows nothing of bodies, merged links, turned frames or acceleration tensors, only of the
//! description, so that it can disagree with the recursion in all of them.

use puma_dyn::nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use puma_dyn::robot::{JointDescription, JointKind};
use puma_dyn::{Context, Effects, RobotDescription, rnea};

use crate::random_tree::{Case, Joints, cases};

#[derive(Clone)]
struct LinkMotion {
    rotation: Matrix3<f64>,
    position: Vector3<f64>,
    omega: Vector3<f64>,
    omega_dot: Vector3<f64>,
    accel: Vector3<f64>,
}

/// Torques of the moving joints in declared order.
fn newton_euler(robot: &RobotDescription, q: &[f64], qd: &[f64], qdd: &[f64]) -> Vec<f64> {
    let moving = robot
        .joints
        .iter()
        .filter(|joint| joint.kind != JointKind::Fixed);
    let torque = |joint: &JointDescription| {
        let axis_link = link_motion(robot, &joint.child, q, qd, qdd);
        let axis = axis_link.rotation * Vector3::from(joint.axis).normalize();
        let (force, moment) = needed_beyond(robot, joint, &axis_link.position, q, qd, qdd);
        if joint.kind == JointKind::Prismatic {
            axis.dot(&force)
        } else {
            axis.dot(&moment)
        }
    };
    moving.map(torque).collect()
}

/// Σ m (a − g) and its moment about `origin`, plus İω̇ + ω × Iω, over all links a joint carries.
fn needed_beyond(
    robot: &RobotDescription,
    joint: &JointDescription,
    origin: &Vector3<f64>,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> (Vector3<f64>, Vector3<f64>) {
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    for link in robot
        .links
        .iter()
        .filter(|link| carries(robot, joint, &link.name))
    {
        let Some(inertial) = link.inertial else {
            continue;
        };
        let motion = link_motion(robot, &link.name, q, qd, qdd);
        let LinkMotion {
            rotation,
            position,
            omega,
            omega_dot,
            accel,
        } = motion;
        let arm = rotation * Vector3::from(inertial.centre);
        let centre_accel = accel + omega_dot.cross(&arm) + omega.cross(&omega.cross(&arm));
        let inertia = rotation * Matrix3::from(inertial.inertia) * rotation.transpose();

        let f = inertial.mass * (centre_accel - Vector3::from(robot.gravity));
        force += f;
        moment += (position + arm - origin).cross(&f)
            + inertia * omega_dot
            + omega.cross(&(inertia * omega));
    }
    (force, moment)
}

fn parent_joint<'a>(robot: &'a RobotDescription, link: &str) -> Option<&'a JointDescription> {
    robot.joints.iter().find(|joint| joint.child == link)
}

fn carries(robot: &RobotDescription, joint: &JointDescription, link: &str) -> bool {
    parent_joint(robot, link)
        .is_some_and(|above| above.name == joint.name || carries(robot, joint, &above.parent))
}

/// Motion of a link's frame in world axes, by the rule of the moving frame.
fn link_motion(
    robot: &RobotDescription,
    link: &str,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
) -> LinkMotion {
    let Some(joint) = parent_joint(robot, link) else {
        let zero = Vector3::zeros();
        let (rotation, omega) = (Matrix3::identity(), zero);
        return LinkMotion {
            rotation,
            position: zero,
            omega,
            omega_dot: zero,
            accel: zero,
        };
    };
    let parent = link_motion(robot, &joint.parent, q, qd, qdd);
    let mut moving = robot
        .joints
        .iter()
        .filter(|joint| joint.kind != JointKind::Fixed);
    let idx = moving.position(|other| other.name == joint.name);
    let (q, qd, qdd) = idx.map_or((0.0, 0.0, 0.0), |idx| (q[idx], qd[idx], qdd[idx]));

    let frame = parent.rotation * joint.origin.rotation;
    let unit = Unit::new_normalize(Vector3::from(joint.axis));
    let axis = frame * unit.into_inner();
    let mut arm = parent.rotation * joint.origin.translation;
    let mut motion = parent.clone();
    motion.rotation = frame;
    if joint.kind == JointKind::Prismatic {
        arm += axis * q;
        motion.accel += axis * qdd + 2.0 * parent.omega.cross(&(axis * qd));
    } else if joint.kind != JointKind::Fixed {
        motion.rotation *= Rotation3::from_axis_angle(&unit, q).into_inner();
        motion.omega += axis * qd;
        motion.omega_dot += axis * qdd + parent.omega.cross(&(axis * qd));
    }
    motion.position += arm;
    motion.accel += parent.omega_dot.cross(&arm) + parent.omega.cross(&parent.omega.cross(&arm));
    motion
}

/// Both methods add some hundred products per joint, none much larger than the largest torque.
const ROUNDING: f64 = 1000.0 * f64::EPSILON;

#[test]
fn the_tensor_recursion_equals_newton_and_euler_link_by_link() {
    for mut case in cases(Joints::Mixed) {
        let Case {
            seed,
            description,
            q,
            qd,
            qdd,
            model,
            workspace,
            ..
        } = &mut case;
        let expected = newton_euler(description, q, qd, qdd);
        let mut tau = vec![0.0; model.n_joints()];
        let empty = Context::empty();
        rnea(
            model,
            workspace,
            Effects::RIGID_BODY,
            &empty,
            q,
            qd,
            qdd,
            &mut tau,
        );
        let scale = expected
            .iter()
            .fold(0.0_f64, |scale, tau| scale.max(tau.abs()));
        for (tau, expected) in tau.iter().zip(&expected) {
            let error = (tau - expected).abs();
            assert!(error < ROUNDING * scale, "seed {seed}: {tau} {expected}");
        }
    }
}
