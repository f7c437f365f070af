//! The geometric Jacobian of a frame, and the part of its acceleration that speeds alone cause.
//!
//! ```text
//! v = J(q) q̇          a = J(q) q̈ + J̇ q̇
//! ```
//! Velocities and accelerations are those of the frame's origin and of its orientation, in the axes
//! of the root link.

use nalgebra::Vector3;

use crate::dynamics::check::check_len;
use crate::dynamics::forward_kin::forward_kinematics;
use crate::dynamics::kinematics::{JointStates, propagate};
use crate::dynamics::workspace::Workspace;
use crate::robot::body::Motion;
use crate::robot::model::Model;

/// Linear and angular part of a velocity or acceleration, in root axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameMotion {
    /// Of the frame's origin: m/s or m/s².
    pub linear: Vector3<f64>,
    /// Of the frame's orientation: rad/s or rad/s².
    pub angular: Vector3<f64>,
}

/// Geometric Jacobian of a frame's origin in root axes.
///
/// ```text
/// column i = (ẑ_i × (p − p_i), ẑ_i) for a turning, (ẑ_i, 0) for a sliding joint on the chain, else 0
/// ```
/// # Shapes
/// `q` (n_joints,), rad or m; `jacobian` (6, n_joints), row after row: linear x, y, z, then angular
/// x, y, z.
///
/// # Panics
/// If a slice has another length or `frame_idx` is not an index into [`Model::frames`].
///
/// # Source
/// Siciliano et al. 2009, *Robotics: Modelling, Planning and Control*, eq. (3.30).
pub fn jacobian(model: &Model, frame_idx: usize, q: &[f64], jacobian: &mut [f64]) {
    let n_joints = model.n_joints();
    check_len("jacobian", jacobian, 6 * n_joints);
    let rot_root_frame = forward_kinematics(model, frame_idx, q).rotation;
    jacobian.fill(0.0);

    let frame = &model.frames()[frame_idx];
    let mut in_body = frame.pose; // the frame as seen from each body on the way to the root
    let mut next = frame.body_idx;
    while let Some(idx) = next {
        let body = &model.bodies()[idx];
        let rot_root_body = rot_root_frame * in_body.rotation.transpose();
        let axis: Vector3<f64> = rot_root_body.column(2).into();
        let (linear, angular) = match body.motion {
            Motion::Revolute => (axis.cross(&(rot_root_body * in_body.translation)), axis),
            Motion::Prismatic => (axis, Vector3::zeros()),
        };
        let column = jacobian[body.joint_idx..].iter_mut().step_by(n_joints);
        column
            .zip(linear.iter().chain(&angular))
            .for_each(|(entry, value)| *entry = *value);
        in_body = body.pose_at(q[body.joint_idx]).compose(&in_body);
        next = body.parent;
    }
}

/// Acceleration of a frame at zero joint accelerations: `J̇ q̇`, without gravity.
///
/// # Shapes
/// `q` and `qd` (n_joints,), rad and rad/s.
///
/// # Panics
/// If a slice has another length, the workspace belongs to another model, or `frame_idx` is not an
/// index into [`Model::frames`].
pub fn bias_acceleration(
    model: &Model,
    workspace: &mut Workspace,
    frame_idx: usize,
    q: &[f64],
    qd: &[f64],
) -> FrameMotion {
    workspace.check(model);
    check_len("qd", qd, model.n_joints());
    let pose = forward_kinematics(model, frame_idx, q);
    let frame = &model.frames()[frame_idx];
    let Some(body_idx) = frame.body_idx else {
        return FrameMotion {
            linear: Vector3::zeros(),
            angular: Vector3::zeros(),
        };
    };
    let Workspace {
        bodies: states,
        zeros,
        ..
    } = workspace;
    propagate(
        model,
        states,
        &Vector3::zeros(),
        JointStates { q, qd, qdd: zeros },
    );

    let state = &states[body_idx];
    let rot_root_body = pose.rotation * frame.pose.rotation.transpose();
    FrameMotion {
        linear: rot_root_body * (state.accel + state.tensor * frame.pose.translation),
        angular: rot_root_body * state.omega_dot,
    }
}
