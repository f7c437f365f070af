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
//!
//! Friction that grows with the load |τ^rb| makes the system piecewise linear: with σ the sign of the load,
//! f its own friction and s its part of the load,
//!
//! ```text
//! τ^rb (1 + σ s) + G² Jm q̈ = τ − f
//! ```
//! is the same system with torque and rotor divided by 1 + σ s, and is solved until the signs stay.

use crate::dynamics::articulated::Articulated;
use crate::dynamics::check::check_len;
use crate::dynamics::friction::smooth_torque;
use crate::dynamics::hysteresis::Memory;
use crate::dynamics::payload::Context;
use crate::dynamics::rnea::rnea;
use crate::dynamics::workspace::Workspace;
use crate::error::DynError;
use crate::robot::body::Motion;
use crate::robot::friction_law::{Effects, Friction};
use crate::robot::model::Model;
use crate::spatial::pose::Pose;

/// Guesses of the loads' signs after which the search is given up; two or three are usual.
const MOST_SIGNS: usize = 100;

/// Accelerations that the torques `tau` produce at the state (`q`, `qd`).
///
/// ```text
/// q̈ = M(q)⁻¹ (τ − c(q, q̇) − g(q) [− friction(q̇)])          M with G² Jm on the diagonal if switched on
/// ```
/// `effects` and `context` as in [`rnea`], which this function inverts, its meaning of hysteresis included.
///
/// # Shapes
/// `q`, `qd`, `tau` and `qdd` (n_joints,): rad, rad/s, N·m, rad/s²; m and N for sliding joints.
///
/// # Errors
/// [`DynError::SingularInertia`] if a joint sees no positive inertia along its axis;
/// [`DynError::LoadFriction`] if friction takes all of a load or more, [`DynError::LoadsUnsettled`] if the search
/// for the loads' directions ends without them.
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
    if effects.friction != Friction::None && model.has_smooth_friction() {
        return under_load(model, workspace, effects, context, q, qd, tau, qdd);
    }
    bias(model, workspace, effects, context, q, qd, qdd);
    qdd.iter_mut()
        .zip(tau)
        .for_each(|(bias, tau)| *bias = tau - *bias);

    let no_load_friction = |_| 1.0;
    solve(model, workspace, effects, context, no_load_friction, qdd)
}

/// The torques at rest of the accelerations.
fn bias(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    qd: &[f64],
    tau: &mut [f64],
) {
    let zeros = std::mem::take(&mut workspace.zeros);
    rnea(model, workspace, effects, context, q, qd, &zeros, tau);
    workspace.zeros = zeros;
}

/// Turns the torques that are left for accelerations into them; `share` is 1 + σ s of a joint.
fn solve(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    share: impl Fn(usize) -> f64,
    qdd: &mut [f64],
) -> Result<(), DynError> {
    reset(model, workspace, context);
    inwards(model, workspace, effects, share, qdd)?;
    outwards(model, workspace, qdd);
    Ok(())
}

/// The accelerations under friction that grows with the load: signs are guessed until they are found again.
#[expect(
    clippy::too_many_arguments,
    reason = "the state and the result are the field's q, qd, tau, qdd"
)]
fn under_load(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    qd: &[f64],
    tau: &[f64],
    qdd: &mut [f64],
) -> Result<(), DynError> {
    let n = model.n_joints();
    let mut load_signs = std::mem::take(&mut workspace.load_signs);
    let friction_at = |joint: usize| {
        let law = model.joint_friction()[joint].law(effects.friction);
        let mut smooth = smooth_torque(model, effects.friction, Memory::Lasting, joint, qd[joint]);
        smooth.own += law.torque(qd[joint]);
        smooth
    };
    let outcome = refuse_full_shares(model, |joint| friction_at(joint).share).and_then(|()| {
        load_signs.fill(1.0);
        for _ in 0..MOST_SIGNS {
            bias(model, workspace, Effects::RIGID_BODY, context, q, qd, qdd);
            let share = |joint: usize| 1.0 + load_signs[joint] * friction_at(joint).share;
            for joint in 0..n {
                qdd[joint] = (tau[joint] - friction_at(joint).own) / share(joint) - qdd[joint];
            }
            solve(model, workspace, effects, context, share, qdd)?;
            let mut is_settled = true;
            for joint in 0..n {
                let rotor = rotor_inertia(model, effects, joint) * qdd[joint];
                let sign = (tau[joint] - friction_at(joint).own - rotor).signum();
                let matters = friction_at(joint).share.abs() > 0.0;
                is_settled &= !matters || (sign - load_signs[joint]).abs() < 1.0;
                load_signs[joint] = sign;
            }
            if is_settled {
                return Ok(());
            }
        }
        Err(DynError::LoadsUnsettled)
    });
    workspace.load_signs = load_signs;
    outcome
}

/// # Errors
/// [`DynError::LoadFriction`] with the first joint whose friction takes all of its load or more.
pub(crate) fn refuse_full_shares(
    model: &Model,
    share: impl Fn(usize) -> f64,
) -> Result<(), DynError> {
    let is_full = |joint: &usize| share(*joint).is_nan() || share(*joint).abs() >= 1.0;
    match (0..model.n_joints()).find(is_full) {
        None => Ok(()),
        Some(joint) => Err(DynError::LoadFriction {
            joint: model.joint_names()[joint].clone(),
            share: share(joint),
        }),
    }
}

fn rotor_inertia(model: &Model, effects: Effects, joint_idx: usize) -> f64 {
    if effects.rotor_inertia {
        model.rotor_inertias()[joint_idx]
    } else {
        0.0
    }
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
    share: impl Fn(usize) -> f64,
    torques: &[f64],
) -> Result<(), DynError> {
    for (idx, body) in model.bodies().iter().enumerate().rev() {
        let (before, rest) = workspace.articulated.split_at_mut(idx);
        let state = &mut rest[0];
        let rotor = rotor_inertia(model, effects, body.joint_idx) / share(body.joint_idx);
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
