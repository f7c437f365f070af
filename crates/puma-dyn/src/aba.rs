//! Forward dynamics: the accelerations that given torques produce, in time linear in the joints.
//!
//! RNEA at q̈ = 0 gives every torque that does not depend on the acceleration. What is left is the
//! linear system
//!
//! ```text
//! M(q) q̈ = τ − rnea(q, q̇, 0)
//! ```
//! which the articulated-body recursion solves without forming M: inwards, each body's inertia loses
//! what its joint lets go and is added to its parent's; outwards, each joint finds its acceleration.
//!
//! # Source
//! Featherstone 2008, *Rigid Body Dynamics Algorithms*, sec. 7.3, here with all velocities zero.

use nalgebra::{Matrix3, Vector3};

use crate::error::DynError;
use crate::friction::Effects;
use crate::model::{Model, Motion};
use crate::payload::Context;
use crate::rnea::rnea;
use crate::spatial::{BodyInertia, Pose, skew};
use crate::workspace::{Workspace, check_len};

/// Inertia of a body as its joint feels it, with everything beyond hanging on free joints.
///
/// ```text
/// | n |   | rotational  coupling      | | ω̇ |   | moment |
/// | f | = | couplingᵀ   translational | | a | + | force  |
/// ```
/// at the origin of the body's frame, in its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Articulated {
    rotational: Matrix3<f64>,
    coupling: Matrix3<f64>,
    translational: Matrix3<f64>,
    moment: Vector3<f64>,
    force: Vector3<f64>,
    /// Wrench per unit of joint acceleration: the inertia's column of the joint's axis.
    column_moment: Vector3<f64>,
    column_force: Vector3<f64>,
    /// The column's component along the axis, rotor included.
    along_axis: f64,
    /// Torque that is left for the joint's acceleration.
    torque: f64,
    omega_dot: Vector3<f64>,
    accel: Vector3<f64>,
}

/// Accelerations that the torques `tau` produce at the state (`q`, `qd`).
///
/// ```text
/// q̈ = M(q)⁻¹ (τ − c(q, q̇) − g(q) [− friction(q̇)])          M with G² Jm on the diagonal if switched on
/// ```
/// `effects` and `context` as in [`rnea`], which this function inverts.
///
/// # Shapes
/// `q`, `qd`, `tau` and `qdd` (n_joints,): rad, rad/s, N·m, rad/s²; m and N for sliding joints.
///
/// # Errors
/// [`DynError::SingularInertia`] if a joint sees no positive inertia along its axis.
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
///
/// # Source
/// Featherstone 2008, *Rigid Body Dynamics Algorithms*, table 7.1.
#[expect(
    clippy::too_many_arguments,
    reason = "the state and the result are the field's q, qd, tau, qdd"
)]
pub fn aba(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) -> Result<(), DynError> {
    check_len("tau", tau, model.n_joints());
    workspace.check(model);
    let zeros = std::mem::take(&mut workspace.zeros);
    rnea(model, workspace, effects, context, q, qd, &zeros, qdd);
    workspace.zeros = zeros;
    qdd.iter_mut()
        .zip(tau)
        .for_each(|(bias, tau)| *bias = tau - *bias);

    reset(model, workspace, context);
    inwards(model, workspace, effects, qdd)?;
    outwards(model, workspace, qdd);
    Ok(())
}

/// Every body with its own inertia and its payloads, free of forces.
fn reset(model: &Model, workspace: &mut Workspace, context: &Context) {
    let articulated = &mut workspace.articulated;
    for (articulated, body) in articulated.iter_mut().zip(model.bodies()) {
        *articulated = Articulated::rigid(&body.inertia);
    }
    for load in context.loads() {
        let load_alone = Articulated::rigid(&load.inertia);
        articulated[load.body_idx].add(&load_alone);
    }
}

/// From the tips to the ground; `torques` (n_joints,) is the right-hand side of the linear system.
fn inwards(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    torques: &[f64],
) -> Result<(), DynError> {
    for (idx, body) in model.bodies().iter().enumerate().rev() {
        let (before, rest) = workspace.articulated.split_at_mut(idx);
        let state = &mut rest[0];
        let rotor = if effects.rotor_inertia {
            model.rotor_inertias()[body.joint_idx]
        } else {
            0.0
        };
        state.split_off_joint(body.motion, rotor, torques[body.joint_idx]);
        if state.along_axis.is_nan() || state.along_axis <= 0.0 {
            let joint = model.joint_names()[body.joint_idx].clone();
            return Err(DynError::SingularInertia {
                joint,
                inertia: state.along_axis,
            });
        }
        if let Some(parent) = body.parent {
            before[parent].add(&state.felt_by_parent(&workspace.bodies[idx].pose));
        }
    }
    Ok(())
}

/// From the ground to the tips.
fn outwards(model: &Model, workspace: &mut Workspace, qdd: &mut [f64]) {
    for (idx, body) in model.bodies().iter().enumerate() {
        let (before, rest) = workspace.articulated.split_at_mut(idx);
        let state = &mut rest[0];
        if let Some(parent) = body.parent.map(|parent| &before[parent]) {
            let Pose {
                rotation,
                translation,
            } = &workspace.bodies[idx].pose;
            let accel = parent.accel + parent.omega_dot.cross(translation);
            state.accel = rotation.tr_mul(&accel);
            state.omega_dot = rotation.tr_mul(&parent.omega_dot);
        }
        let carried =
            state.column_moment.dot(&state.omega_dot) + state.column_force.dot(&state.accel);
        let acceleration = (state.torque - carried) / state.along_axis;
        match body.motion {
            Motion::Revolute => state.omega_dot.z += acceleration,
            Motion::Prismatic => state.accel.z += acceleration,
        }
        qdd[body.joint_idx] = acceleration;
    }
}

impl Articulated {
    /// A rigid body on its own, at rest.
    pub(crate) fn rigid(inertia: &BodyInertia) -> Self {
        Self {
            rotational: inertia.inertia_at_origin(),
            coupling: skew(&inertia.first_moment),
            translational: Matrix3::from_diagonal_element(inertia.mass),
            moment: Vector3::zeros(),
            force: Vector3::zeros(),
            column_moment: Vector3::zeros(),
            column_force: Vector3::zeros(),
            along_axis: 0.0,
            torque: 0.0,
            omega_dot: Vector3::zeros(),
            accel: Vector3::zeros(),
        }
    }

    fn add(&mut self, other: &Self) {
        self.rotational += other.rotational;
        self.coupling += other.coupling;
        self.translational += other.translational;
        self.moment += other.moment;
        self.force += other.force;
    }

    /// Sets the column of the joint's axis and the torque that is left for its acceleration.
    fn split_off_joint(&mut self, motion: Motion, rotor_inertia: f64, torque: f64) {
        let along_axis = match motion {
            Motion::Revolute => {
                self.column_moment = self.rotational.column(2).into();
                self.column_force = self.coupling.row(2).transpose();
                self.torque = torque - self.moment.z;
                self.column_moment.z
            }
            Motion::Prismatic => {
                self.column_moment = self.coupling.column(2).into();
                self.column_force = self.translational.column(2).into();
                self.torque = torque - self.force.z;
                self.column_force.z
            }
        };
        self.along_axis = along_axis + rotor_inertia;
    }

    /// What the parent has to move: this body less what its joint lets go, in the parent's frame.
    ///
    /// ```text
    /// I_a = I − c cᵀ / d,   p_a = p + c u / d           c column, d along the axis, u torque left
    /// J' = J − H P + P (H + P M)ᵀ,   H' = H + P M       P = [p]×, all rotated to parent axes
    /// ```
    fn felt_by_parent(&self, pose: &Pose) -> Self {
        let (c_n, c_f) = (&self.column_moment, &self.column_force);
        let scaled_n = c_n / self.along_axis;
        let scaled_f = c_f / self.along_axis;

        let r = &pose.rotation;
        let rotate = |block: Matrix3<f64>| r * block * r.transpose();
        let rotational = rotate(self.rotational - scaled_n * c_n.transpose());
        let coupling = rotate(self.coupling - scaled_n * c_f.transpose());
        let translational = rotate(self.translational - scaled_f * c_f.transpose());
        let force = r * (self.force + scaled_f * self.torque);
        let moment = r * (self.moment + scaled_n * self.torque);

        let p = skew(&pose.translation);
        let shifted_coupling = coupling + p * translational;
        Self {
            rotational: rotational - coupling * p + p * shifted_coupling.transpose(),
            coupling: shifted_coupling,
            translational,
            moment: moment + pose.translation.cross(&force),
            force,
            ..*self
        }
    }
}
