//! How every body moves, from the ground outwards: the first pass of all recursions.
//!
//! Each body keeps its motion in its own axes, at the origin of its joint:
//!
//! ```text
//! ω_i = Eᵀ ω_p + ẑ q̇          ω̇_i = Eᵀ ω̇_p + (Eᵀ ω_p) × ẑ q̇ + ẑ q̈
//! U_i = [ω̇_i]× + [ω_i]×²       a_i = Eᵀ (a_p + U_p p)
//! ```
//! E and p are the rotation and translation of the body's frame in its parent's. A sliding joint
//! keeps ω and ω̇ and adds ẑ q̈ + 2 ω_i × ẑ q̇ to a_i instead. The acceleration tensor U gives the
//! acceleration of any point r of the body as a_i + U_i r.
//!
//! # Source
//! Balafoutis & Patel 1991, *Dynamic Analysis of Robot Manipulators: A Cartesian Tensor Approach*,
//! ch. 5.

use nalgebra::{Matrix3, Vector3};

use crate::robot::body::{Body, Motion};
use crate::robot::model::Model;
use crate::spatial::pose::Pose;

/// Motion of one body and the force and moment it needs, in its own axes.
#[derive(Debug, Clone)]
pub(crate) struct BodyState {
    /// Pose of the body's frame in its parent's at the current joint position.
    pub pose: Pose,
    /// Angular velocity, rad/s.
    pub omega: Vector3<f64>,
    /// Angular acceleration, rad/s².
    pub omega_dot: Vector3<f64>,
    /// Acceleration tensor U, 1/s².
    pub tensor: Matrix3<f64>,
    /// Acceleration of the joint's origin, m/s²; gravity is an upward acceleration of the ground.
    pub accel: Vector3<f64>,
    /// Force through the joint, N.
    pub force: Vector3<f64>,
    /// Moment through the joint about its origin, N·m.
    pub moment: Vector3<f64>,
}

impl BodyState {
    pub(crate) fn at_rest() -> Self {
        Self {
            pose: Pose::identity(),
            omega: Vector3::zeros(),
            omega_dot: Vector3::zeros(),
            tensor: Matrix3::zeros(),
            accel: Vector3::zeros(),
            force: Vector3::zeros(),
            moment: Vector3::zeros(),
        }
    }

    /// The component of the joint's force or moment that its motor supplies.
    #[inline]
    pub(crate) fn along_axis(&self, motion: Motion) -> f64 {
        match motion {
            Motion::Revolute => self.moment.z,
            Motion::Prismatic => self.force.z,
        }
    }
}

/// Position, speed and acceleration of every joint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointStates<'a> {
    pub q: &'a [f64],
    pub qd: &'a [f64],
    pub qdd: &'a [f64],
}

impl Body {
    /// Pose of the body's frame in its parent's at joint position `q`.
    #[inline]
    pub(crate) fn pose_at(&self, q: f64) -> Pose {
        let Pose {
            rotation,
            translation,
        } = &self.pose;
        match self.motion {
            Motion::Revolute => {
                let (s, c) = q.sin_cos();
                let (x, y) = (rotation.column(0), rotation.column(1));
                let columns = [x * c + y * s, y * c - x * s, rotation.column(2).into()];
                Pose::new(Matrix3::from_columns(&columns), *translation)
            }
            Motion::Prismatic => Pose::new(*rotation, translation + rotation.column(2) * q),
        }
    }
}

/// Sets `pose`, `omega`, `omega_dot`, `tensor` and `accel` of every body.
///
/// `ground_accel` is the acceleration of the root link in its own axes: minus gravity, or zero.
#[inline]
pub(crate) fn propagate(
    model: &Model,
    states: &mut [BodyState],
    ground_accel: &Vector3<f64>,
    joints: JointStates<'_>,
) {
    for (idx, body) in model.bodies().iter().enumerate() {
        let (done, rest) = states.split_at_mut(idx);
        let joint = body.joint_idx;
        let (q, qd, qdd) = (joints.q[joint], joints.qd[joint], joints.qdd[joint]);
        let pose = body.pose_at(q);
        let (omega, omega_dot, accel) = match body.parent {
            None => carried_by_ground(&pose, ground_accel),
            Some(parent) => carried_by(&done[parent], &pose),
        };
        let state = &mut rest[0];
        state.pose = pose;
        match body.motion {
            Motion::Revolute => {
                state.omega = Vector3::new(omega.x, omega.y, omega.z + qd);
                state.omega_dot = Vector3::new(
                    omega_dot.x + omega.y * qd,
                    omega_dot.y - omega.x * qd,
                    omega_dot.z + qdd,
                );
                state.accel = accel;
            }
            Motion::Prismatic => {
                state.omega = omega;
                state.omega_dot = omega_dot;
                state.accel = Vector3::new(
                    accel.x + 2.0 * omega.y * qd,
                    accel.y - 2.0 * omega.x * qd,
                    accel.z + qdd,
                );
            }
        }
        state.tensor = acceleration_tensor(&state.omega, &state.omega_dot);
    }
}

/// ω, ω̇ and a of a body welded to the ground.
#[inline]
fn carried_by_ground(
    pose: &Pose,
    ground_accel: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    (
        Vector3::zeros(),
        Vector3::zeros(),
        pose.rotation.tr_mul(ground_accel),
    )
}

/// ω, ω̇ and a of a body welded to its parent.
#[inline]
fn carried_by(parent: &BodyState, pose: &Pose) -> (Vector3<f64>, Vector3<f64>, Vector3<f64>) {
    let accel = parent.accel + parent.tensor * pose.translation;
    (
        pose.rotation.tr_mul(&parent.omega),
        pose.rotation.tr_mul(&parent.omega_dot),
        pose.rotation.tr_mul(&accel),
    )
}

/// `U = [ω̇]× + [ω]×²`, with `[ω]×² = ω ωᵀ − (ω·ω) 1`.
#[inline]
fn acceleration_tensor(omega: &Vector3<f64>, omega_dot: &Vector3<f64>) -> Matrix3<f64> {
    let (xx, yy, zz) = (omega.x * omega.x, omega.y * omega.y, omega.z * omega.z);
    let (xy, xz, yz) = (omega.x * omega.y, omega.x * omega.z, omega.y * omega.z);
    let d = omega_dot;
    Matrix3::new(
        -yy - zz,
        xy - d.z,
        xz + d.y,
        xy + d.z,
        -xx - zz,
        yz - d.x,
        xz - d.y,
        yz + d.x,
        -xx - yy,
    )
}
