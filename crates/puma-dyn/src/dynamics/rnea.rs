//! Inverse dynamics: the joint torques that a motion needs, by the recursive Newton–Euler algorithm.
//!
//! The inward pass sums forces and moments at each joint's origin, in the axes of its body:
//!
//! ```text
//! f_i = m a + U h + Σ_children E f_c                       h = m c, first mass moment
//! n_i = h × a + axial(U Σ) + Σ_children (E n_c + p × E f_c)  Σ = ∫ r rᵀ dm
//! τ_i = ẑ·n_i (turning)  or  ẑ·f_i (sliding)
//! ```
//! where axial(A) = (A32 − A23, A13 − A31, A21 − A12). Because U already holds ω̇ and ω ω, this needs
//! far fewer operations than the classical form with I ω̇ + ω × I ω, and is equal to it.
//!
//! # Source
//! Luh, Walker & Paul 1980 for the recursion; Balafoutis & Patel 1991, ch. 5, for the tensor form;
//! Featherstone 2008, *Rigid Body Dynamics Algorithms*, sec. 5.3, for trees.

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::check::check_len;
use crate::dynamics::friction::add_friction;
use crate::dynamics::hysteresis::{Hysteresis, Memory};
use crate::dynamics::kinematics::{BodyState, JointStates, propagate};
use crate::dynamics::payload::{AttachedPayload, Context};
use crate::dynamics::workspace::Workspace;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;
use crate::spatial::inertia::BodyInertia;

/// Torques that produce the accelerations `qdd` at the state (`q`, `qd`).
///
/// ```text
/// τ = M(q) q̈ + c(q, q̇) + g(q)  [+ friction(q̇)]  [+ G² Jm q̈]
/// ```
/// What stands in brackets is switched by `effects`; `context` is what the arm carries.
/// Friction with memory is that of a motion which has lasted, z = sgn q̇; [`rnea_with_hysteresis`] has it as it is.
///
/// # Shapes
/// `q`, `qd`, `qdd` and `tau` (n_joints,): rad, rad/s, rad/s², N·m; m and N for sliding joints.
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
///
/// # Source
/// Luh, Walker & Paul 1980, "On-line computational scheme for mechanical manipulators".
#[expect(
    clippy::too_many_arguments,
    reason = "the state and the result are the field's q, qd, qdd, tau"
)]
pub fn rnea(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
) {
    let states = JointStates { q, qd, qdd };
    remembering(
        model,
        workspace,
        effects,
        context,
        Memory::Lasting,
        states,
        tau,
    );
}

/// As [`rnea`], with the hysteresis states that friction is in.
///
/// They are those at the state: whoever follows a motion calls [`Hysteresis::advance`] first.
///
/// # Panics
/// As [`rnea`], and if the hysteresis belongs to another model.
#[expect(
    clippy::too_many_arguments,
    reason = "the state and the result are the field's q, qd, qdd, tau"
)]
pub fn rnea_with_hysteresis(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    hysteresis: &Hysteresis,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    tau: &mut [f64],
) {
    hysteresis.check(model);
    let memory = Memory::States(hysteresis.states());
    let states = JointStates { q, qd, qdd };
    remembering(model, workspace, effects, context, memory, states, tau);
}

/// The algorithm, with hysteresis states from anywhere.
#[inline]
fn remembering(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    memory: Memory<'_>,
    joints: JointStates<'_>,
    tau: &mut [f64],
) {
    let n_joints = model.n_joints();
    workspace.check(model);
    let JointStates { q, qd, qdd } = joints;
    for (what, slice) in [("q", q), ("qd", qd), ("qdd", qdd)] {
        check_len(what, slice, n_joints);
    }
    check_len("tau", tau, n_joints);

    let states = &mut workspace.bodies[..];
    propagate(model, states, &-model.gravity_vector(), joints);
    body_forces(model, states);
    add_load_forces(context.loads(), states);
    gather(model, states, tau);

    add_friction(model, effects.friction, memory, qd, tau);
    if effects.rotor_inertia {
        add_rotor_torques(model, qdd, tau);
    }
}

/// Force and moment that each body needs for its own motion.
#[inline]
pub(crate) fn body_forces(model: &Model, states: &mut [BodyState]) {
    for (body, state) in model.bodies().iter().zip(states) {
        (state.force, state.moment) = wrench(&body.inertia, state);
    }
}

/// Adds the force and moment that each payload needs for its motion.
#[inline]
pub(crate) fn add_load_forces(loads: &[AttachedPayload], states: &mut [BodyState]) {
    for load in loads {
        let state = &mut states[load.body_idx];
        let (force, moment) = wrench(&load.inertia, state);
        state.force += force;
        state.moment += moment;
    }
}

/// The inward pass: hands every body's force and moment on to its parent and reads off the torques.
#[inline]
pub(crate) fn gather(model: &Model, states: &mut [BodyState], tau: &mut [f64]) {
    for (idx, body) in model.bodies().iter().enumerate().rev() {
        let (before, rest) = states.split_at_mut(idx);
        let state = &rest[0];
        tau[body.joint_idx] = state.along_axis(body.motion);
        if let Some(parent) = body.parent {
            let parent = &mut before[parent];
            let force = state.pose.rotation * state.force;
            parent.moment +=
                state.pose.rotation * state.moment + state.pose.translation.cross(&force);
            parent.force += force;
        }
    }
}

/// Adds the torques that accelerate the rotors, G² Jm q̈.
#[inline]
pub(crate) fn add_rotor_torques(model: &Model, qdd: &[f64], tau: &mut [f64]) {
    for ((tau, qdd), rotor_inertia) in tau.iter_mut().zip(qdd).zip(model.rotor_inertias()) {
        *tau += rotor_inertia * qdd;
    }
}

/// `f = m a + U h` and `n = h × a + axial(U Σ)`.
#[inline]
fn wrench(inertia: &BodyInertia, state: &BodyState) -> (Vector3<f64>, Vector3<f64>) {
    let BodyInertia {
        mass,
        first_moment,
        second_moment,
    } = inertia;
    let force = *mass * state.accel + state.tensor * first_moment;
    let moment = first_moment.cross(&state.accel) + axial_of_product(&state.tensor, second_moment);
    (force, moment)
}

/// `axial(A B)` for symmetric B: (AB)_ij is the product of row i of A with column j of B.
#[inline]
fn axial_of_product(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Vector3<f64> {
    let entry =
        |i: usize, j: usize| a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)];
    Vector3::new(
        entry(2, 1) - entry(1, 2),
        entry(0, 2) - entry(2, 0),
        entry(1, 0) - entry(0, 1),
    )
}
