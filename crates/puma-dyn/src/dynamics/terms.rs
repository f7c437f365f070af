//! The torque taken apart: inertia, Coriolis, gravity, payload, friction and rotors.
//!
//! RNEA is linear in the mass distribution, in gravity and in (q̈, q̇ q̇), so switching all but one of
//! them off leaves one term, and the terms add up to the whole. "Coriolis" includes the centrifugal
//! torques.
//!
//! # Source
//! Eq. (2), with asymmetric Coulomb friction as in sec. 2.1.

use nalgebra::Vector3;

use crate::dynamics::check::check_len;
use crate::dynamics::friction::joint_friction;
use crate::dynamics::hysteresis::{Hysteresis, Memory};
use crate::dynamics::kinematics::{JointStates, propagate};
use crate::dynamics::payload::Context;
use crate::dynamics::rnea::{add_load_forces, add_rotor_torques, body_forces, gather};
use crate::dynamics::workspace::Workspace;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;

/// Torques that hold the arm still against gravity, payloads included.
///
/// ```text
/// g(q) = ∂V/∂q
/// ```
/// # Shapes
/// `q` and `tau` (n_joints,), rad and N·m; m and N for sliding joints.
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
pub fn gravity_torques(
    model: &Model,
    workspace: &mut Workspace,
    context: &Context,
    q: &[f64],
    tau: &mut [f64],
) {
    check_len("q", q, model.n_joints());
    check_len("tau", tau, model.n_joints());
    let ground = -model.gravity_vector();
    rigid_torques(
        model,
        workspace,
        Who::All(context),
        &ground,
        (q, None, None),
        tau,
    );
}

/// Torques of the Coriolis and centrifugal forces, payloads included.
///
/// ```text
/// c(q, q̇) = C(q, q̇) q̇
/// ```
/// # Shapes
/// `q`, `qd` and `tau` (n_joints,), rad, rad/s and N·m; m and N for sliding joints.
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
pub fn coriolis_torques(
    model: &Model,
    workspace: &mut Workspace,
    context: &Context,
    q: &[f64],
    qd: &[f64],
    tau: &mut [f64],
) {
    for (what, slice) in [("q", q), ("qd", qd), ("tau", &*tau)] {
        check_len(what, slice, model.n_joints());
    }
    let who = Who::All(context);
    rigid_torques(
        model,
        workspace,
        who,
        &Vector3::zeros(),
        (q, Some(qd), None),
        tau,
    );
}

/// The six parts of the joint torques, each (n_joints,), N·m or N.
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueTerms {
    /// `M(q) q̈` of the arm without payload and rotors.
    pub inertia: Vec<f64>,
    /// `C(q, q̇) q̇` of the arm without payload.
    pub coriolis: Vec<f64>,
    /// `g(q)` of the arm without payload.
    pub gravity: Vec<f64>,
    /// Everything the payloads add: their inertia, Coriolis and gravity torques.
    pub payload: Vec<f64>,
    /// Friction, zero if switched off.
    pub friction: Vec<f64>,
    /// `G² Jm q̈`, zero if switched off.
    pub rotor: Vec<f64>,
}

impl TorqueTerms {
    /// Room for the terms of a model, all zero.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let zeros = vec![0.0; model.n_joints()];
        Self {
            inertia: zeros.clone(),
            coriolis: zeros.clone(),
            gravity: zeros.clone(),
            payload: zeros.clone(),
            friction: zeros.clone(),
            rotor: zeros,
        }
    }

    /// Name and values of each term, in a fixed order.
    #[must_use]
    pub fn named(&self) -> [(&'static str, &[f64]); 6] {
        [
            ("inertia", &self.inertia),
            ("coriolis", &self.coriolis),
            ("gravity", &self.gravity),
            ("payload", &self.payload),
            ("friction", &self.friction),
            ("rotor", &self.rotor),
        ]
    }

    /// Rigid-body torque of one joint, of links and payload.
    fn rigid(&self, joint_idx: usize) -> f64 {
        [&self.inertia, &self.coriolis, &self.gravity, &self.payload]
            .iter()
            .map(|term| term[joint_idx])
            .sum()
    }

    /// Sum of the terms of one joint: [`rnea`](crate::rnea) to rounding.
    ///
    /// # Panics
    /// If the model has no such joint.
    #[must_use]
    pub fn total(&self, joint_idx: usize) -> f64 {
        self.named().iter().map(|(_, term)| term[joint_idx]).sum()
    }
}

/// Splits the torques of [`rnea`](crate::rnea) into their terms.
///
/// ```text
/// τ = inertia + coriolis + gravity + payload + friction + rotor
/// ```
/// Arguments as for `rnea`; allocates nothing.
/// Friction with memory is that of a motion which has lasted, as there.
///
/// # Shapes
/// `q`, `qd` and `qdd` (n_joints,); `terms` made by [`TorqueTerms::new`] for this model.
///
/// # Panics
/// If a slice has another length, or the workspace or a payload belongs to another model.
#[expect(
    clippy::too_many_arguments,
    reason = "the state is the field's q, qd, qdd"
)]
pub fn torque_terms(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    terms: &mut TorqueTerms,
) {
    let states = JointStates { q, qd, qdd };
    remembering(
        model,
        workspace,
        effects,
        context,
        Memory::Lasting,
        states,
        terms,
    );
}

/// As [`torque_terms`], with the hysteresis states that friction is in.
///
/// # Panics
/// As [`torque_terms`], and if the hysteresis belongs to another model.
#[expect(
    clippy::too_many_arguments,
    reason = "the state is the field's q, qd, qdd"
)]
pub fn torque_terms_with_hysteresis(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    hysteresis: &Hysteresis,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    terms: &mut TorqueTerms,
) {
    hysteresis.check(model);
    let memory = Memory::States(hysteresis.states());
    let states = JointStates { q, qd, qdd };
    remembering(model, workspace, effects, context, memory, states, terms);
}

/// The split, with hysteresis states from anywhere.
fn remembering(
    model: &Model,
    workspace: &mut Workspace,
    effects: Effects,
    context: &Context,
    memory: Memory<'_>,
    JointStates { q, qd, qdd }: JointStates<'_>,
    terms: &mut TorqueTerms,
) {
    for (what, slice) in [
        ("q", q),
        ("qd", qd),
        ("qdd", qdd),
        ("terms", &terms.inertia),
    ] {
        check_len(what, slice, model.n_joints());
    }
    let (ground, weightless) = (-model.gravity_vector(), Vector3::zeros());
    let mut rigid = |who, ground, motion, tau: &mut [f64]| {
        rigid_torques(model, workspace, who, ground, motion, tau);
    };
    rigid(
        Who::Arm,
        &weightless,
        (q, None, Some(qdd)),
        &mut terms.inertia,
    );
    rigid(
        Who::Arm,
        &weightless,
        (q, Some(qd), None),
        &mut terms.coriolis,
    );
    rigid(Who::Arm, &ground, (q, None, None), &mut terms.gravity);
    rigid(
        Who::Payloads(context),
        &ground,
        (q, Some(qd), Some(qdd)),
        &mut terms.payload,
    );

    for (joint_idx, &qd) in qd.iter().enumerate() {
        let rigid = terms.rigid(joint_idx);
        terms.friction[joint_idx] =
            joint_friction(model, effects.friction, memory, joint_idx, qd, rigid);
    }
    terms.rotor.fill(0.0);
    if effects.rotor_inertia {
        add_rotor_torques(model, qdd, &mut terms.rotor);
    }
}

/// Whose forces count.
#[derive(Clone, Copy)]
pub(crate) enum Who<'a> {
    Arm,
    Payloads(&'a Context),
    All(&'a Context),
}

/// q, and q̇ and q̈ unless they are zero.
pub(crate) type MaybeMoving<'a> = (&'a [f64], Option<&'a [f64]>, Option<&'a [f64]>);

/// RNEA with some of its causes switched off; neither friction nor rotors.
pub(crate) fn rigid_torques(
    model: &Model,
    workspace: &mut Workspace,
    who: Who<'_>,
    ground_accel: &Vector3<f64>,
    (q, qd, qdd): MaybeMoving<'_>,
    tau: &mut [f64],
) {
    workspace.check(model);
    let Workspace {
        bodies: states,
        zeros,
        ..
    } = workspace;
    let joints = JointStates {
        q,
        qd: qd.unwrap_or(zeros),
        qdd: qdd.unwrap_or(zeros),
    };
    propagate(model, states, ground_accel, joints);
    match who {
        Who::Arm | Who::All(_) => body_forces(model, states),
        Who::Payloads(_) => {
            for state in &mut *states {
                (state.force, state.moment) = (Vector3::zeros(), Vector3::zeros());
            }
        }
    }
    if let Who::Payloads(context) | Who::All(context) = who {
        add_load_forces(context.loads(), states);
    }
    gather(model, states, tau);
}
