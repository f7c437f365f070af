//! Kinetic and potential energy of the arm and what it carries.

use nalgebra::Vector3;

use crate::dynamics::check::check_len;
use crate::dynamics::payload::Context;
use crate::dynamics::terms::{Who, rigid_torques};
use crate::dynamics::workspace::Workspace;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;

/// Kinetic energy, J.
///
/// ```text
/// T = ½ q̇ᵀ M(q) q̇
/// ```
/// M q̇ is what RNEA gives at rest, without gravity, for accelerations equal to q̇.
/// `effects.rotor_inertia` adds the rotors' ½ G² Jm q̇²; friction plays no part.
///
/// # Shapes
/// `q` and `qd` (n_joints,), rad and rad/s.
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
pub fn kinetic_energy(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    qd: &[f64],
) -> f64 {
    check_len("q", q, model.n_joints());
    check_len("qd", qd, model.n_joints());
    let mut momentum = std::mem::take(&mut workspace.momentum);
    let (who, weightless) = (Who::All(context), Vector3::zeros());
    rigid_torques(
        model,
        workspace,
        who,
        &weightless,
        (q, None, Some(qd)),
        &mut momentum,
    );
    let bodies: f64 = momentum
        .iter()
        .zip(qd)
        .map(|(momentum, qd)| 0.5 * momentum * qd)
        .sum();
    workspace.momentum = momentum;

    let rotors = model
        .rotor_inertias()
        .iter()
        .zip(qd)
        .map(|(rotor, qd)| 0.5 * rotor * qd * qd);
    bodies
        + if effects.rotor_inertia {
            rotors.sum()
        } else {
            0.0
        }
}

/// Potential energy, J, zero with all mass at the origin of the root link.
///
/// ```text
/// V = −Σ g · ∫ r dm
/// ```
/// # Shapes
/// `q` (n_joints,), rad or m.
///
/// # Panics
/// If `q` has another length, or the workspace or a payload belongs to another model.
pub fn potential_energy(
    model: &Model,
    workspace: &mut Workspace,
    context: &Context,
    q: &[f64],
) -> f64 {
    check_len("q", q, model.n_joints());
    workspace.check(model);
    let states = &mut workspace.bodies;
    let mut first_moment = Vector3::zeros(); // ∫ r dm in root axes, kg m
    for (idx, body) in model.bodies().iter().enumerate() {
        let pose = body.pose_at(q[body.joint_idx]);
        states[idx].pose = match body.parent {
            None => pose,
            Some(parent) => states[parent].pose.compose(&pose),
        };
        first_moment += body.inertia.in_parent(&states[idx].pose).first_moment;
    }
    for load in context.loads() {
        first_moment += load
            .inertia
            .in_parent(&states[load.body_idx].pose)
            .first_moment;
    }
    -model.gravity_vector().dot(&first_moment)
}
