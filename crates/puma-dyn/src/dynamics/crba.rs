//! The joint-space inertia matrix, by the composite-rigid-body algorithm.
//!
//! Column i holds the torques that accelerate joint i alone, at rest and without gravity: everything
//! beyond joint i then moves as one rigid body, whose ten inertial parameters are the sum of its
//! parts'. The force this needs is handed down to the ground, and every joint on the way sees its
//! component along the axis.
//!
//! # Source
//! Walker & Orin 1982, method 3; Featherstone 2008, *Rigid Body Dynamics Algorithms*, table 6.2.

use nalgebra::Vector3;

use crate::dynamics::check::check_len;
use crate::dynamics::payload::Context;
use crate::dynamics::workspace::Workspace;
use crate::robot::body::Motion;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;
use crate::spatial::inertia::BodyInertia;

/// The symmetric matrix M(q) of the kinetic energy.
///
/// ```text
/// T = ½ q̇ᵀ M(q) q̇          τ = M(q) q̈ + …
/// ```
/// `effects.rotor_inertia` adds G² Jm on the diagonal; friction plays no part.
///
/// # Shapes
/// `q` (n_joints,), rad or m; `inertia_matrix` (n_joints, n_joints), row after row, kg m² (kg m or
/// kg where joints slide).
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
///
/// # Source
/// Walker & Orin 1982, "Efficient dynamic computer simulation of robotic mechanisms", method 3.
pub fn crba(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    inertia_matrix: &mut [f64],
) {
    let n_joints = model.n_joints();
    workspace.check(model);
    check_len("q", q, n_joints);
    check_len("inertia_matrix", inertia_matrix, n_joints * n_joints);

    inertia_matrix.fill(0.0);
    sum_composites(model, workspace, context, q);
    for (idx, body) in model.bodies().iter().enumerate() {
        let (force, moment) = unit_acceleration(&workspace.composite[idx], body.motion);
        fill_row(model, workspace, idx, force, moment, inertia_matrix);
    }
    if effects.rotor_inertia {
        let diagonal = inertia_matrix.iter_mut().step_by(n_joints + 1);
        diagonal
            .zip(model.rotor_inertias())
            .for_each(|(entry, rotor)| *entry += rotor);
    }
}

/// Sets every body's pose and the inertia of all that it carries, itself included.
fn sum_composites(model: &Model, workspace: &mut Workspace, context: &Context, q: &[f64]) {
    let Workspace {
        bodies: states,
        composite,
        ..
    } = workspace;
    for ((body, state), composite) in model.bodies().iter().zip(&mut *states).zip(&mut *composite) {
        state.pose = body.pose_at(q[body.joint_idx]);
        *composite = body.inertia;
    }
    for load in context.loads() {
        composite[load.body_idx].add(&load.inertia);
    }
    for (idx, body) in model.bodies().iter().enumerate().rev() {
        if let Some(parent) = body.parent {
            let carried = composite[idx].in_parent(&states[idx].pose);
            composite[parent].add(&carried);
        }
    }
}

/// Force and moment for a unit acceleration along or about z: the tensor of ẑ is [ẑ]×.
///
/// ```text
/// turning  f = ẑ × h,  n = I ẑ            sliding  f = m ẑ,  n = h × ẑ
/// ```
fn unit_acceleration(inertia: &BodyInertia, motion: Motion) -> (Vector3<f64>, Vector3<f64>) {
    let (h, s) = (&inertia.first_moment, &inertia.second_moment);
    match motion {
        Motion::Revolute => (
            Vector3::new(-h.y, h.x, 0.0),
            Vector3::new(-s[(0, 2)], -s[(1, 2)], s[(0, 0)] + s[(1, 1)]),
        ),
        Motion::Prismatic => (
            Vector3::new(0.0, 0.0, inertia.mass),
            Vector3::new(h.y, -h.x, 0.0),
        ),
    }
}

/// Hands a body's force down to the ground and notes what each joint on the way sees of it.
fn fill_row(
    model: &Model,
    workspace: &Workspace,
    body_idx: usize,
    mut force: Vector3<f64>,
    mut moment: Vector3<f64>,
    inertia_matrix: &mut [f64],
) {
    let n_joints = model.n_joints();
    let row = model.bodies()[body_idx].joint_idx;
    let mut next = Some(body_idx);
    while let Some(idx) = next {
        let body = &model.bodies()[idx];
        let entry = match body.motion {
            Motion::Revolute => moment.z,
            Motion::Prismatic => force.z,
        };
        inertia_matrix[row * n_joints + body.joint_idx] = entry;
        inertia_matrix[body.joint_idx * n_joints + row] = entry;
        let pose = &workspace.bodies[idx].pose;
        force = pose.rotation * force;
        moment = pose.rotation * moment + pose.translation.cross(&force);
        next = body.parent;
    }
}
