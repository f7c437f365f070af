//! The regressor: rigid-body torques are linear in the inertial parameters.
//!
//! ```text
//! τ = Y(q, q̇, q̈) π          π = (π_1, …, π_n),  ten numbers per moving body
//! π_i = [m, m c_x, m c_y, m c_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz]
//! ```
//! I is about the *origin* of the joint's child link frame, in its axes, its entries those of the
//! tensor (I_xy = −∫ x y dm). Links behind fixed joints are part of the body that carries them.
//!
//! # Source
//! Eqs. (10)–(12); Atkeson, An & Hollerbach 1986, "Estimation of inertial parameters of manipulator
//! loads and links"; the order of the ten is Pinocchio's (`Inertia::toDynamicParameters`).

use nalgebra::{Matrix3, Vector3};

use crate::dynamics::check::check_len;
use crate::dynamics::kinematics::{BodyState, JointStates, propagate};
use crate::dynamics::payload::Context;
use crate::dynamics::unit_motion::UnitMotion;
use crate::dynamics::workspace::Workspace;
use crate::robot::model::Model;

/// Inertial parameters per body.
pub const N_PARAMETERS: usize = 10;

/// Rows and columns of I_xx, I_xy, I_yy, I_xz, I_yz, I_zz.
const TENSOR_ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)];

/// The matrix Y of `τ = Y π`, rigid bodies only, under the model's gravity.
///
/// # Shapes
/// `q`, `qd` and `qdd` (n_joints,); `regressor` (n_joints, 10 n_joints), row after row. Columns 10 i
/// to 10 i + 9 belong to the body of joint i.
///
/// # Panics
/// If a slice has another length, or the workspace belongs to another model.
pub fn regressor(
    model: &Model,
    workspace: &mut Workspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    regressor: &mut [f64],
) {
    let row_length = model.n_joints() * N_PARAMETERS;
    check_len("regressor", regressor, model.n_joints() * row_length);
    regressor.fill(0.0);
    fill_bodies(model, workspace, (q, qd, qdd), regressor, row_length);
}

/// Writes what is not zero in the columns of the bodies, the first of rows of a given length.
///
/// Each body is seen once: how it would move at unit speed of every joint that carries it comes from
/// its parent, and the virtual power of the ten unit wrenches along that motion is the joint's row.
pub(super) fn fill_bodies(
    model: &Model,
    workspace: &mut Workspace,
    (q, qd, qdd): (&[f64], &[f64], &[f64]),
    matrix: &mut [f64],
    row_length: usize,
) {
    workspace.check(model);
    for (what, slice) in [("q", q), ("qd", qd), ("qdd", qdd)] {
        check_len(what, slice, model.n_joints());
    }
    let Workspace {
        bodies: states,
        unit_motions,
        ..
    } = workspace;
    propagate(
        model,
        states,
        &-model.gravity_vector(),
        JointStates { q, qd, qdd },
    );
    let bodies = model.bodies();
    for (body_idx, body) in bodies.iter().enumerate() {
        let (before, own) = unit_motions.split_at_mut(body_idx * bodies.len());
        let in_link = LinkState::new(&states[body_idx], &body.rot_link_body);
        let first_column = body.joint_idx * N_PARAMETERS;
        let mut next = Some(body_idx);
        while let Some(joint_body) = next {
            let mover = &bodies[joint_body];
            let motion = match body.parent {
                Some(parent) if joint_body != body_idx => {
                    let of_parent = &before[parent * bodies.len() + joint_body];
                    of_parent.carried(&states[body_idx].pose)
                }
                _ => UnitMotion::of_own_joint(mover.motion),
            };
            let entries = &mut matrix[mover.joint_idx * row_length + first_column..];
            in_link.powers(&motion, &mut entries[..N_PARAMETERS]);
            own[joint_body] = motion;
            next = mover.parent;
        }
    }
}

/// The parameters π of a model and what it carries, (10 n_joints,), kg, kg m and kg m².
///
/// # Panics
/// If a payload belongs to another model.
#[must_use]
pub fn inertial_parameters(model: &Model, context: &Context) -> Vec<f64> {
    let mut parameters = vec![0.0; model.n_joints() * N_PARAMETERS];
    for (body_idx, body) in model.bodies().iter().enumerate() {
        let mut inertia = body.inertia;
        let loads = context
            .loads()
            .iter()
            .filter(|load| load.body_idx == body_idx);
        loads.for_each(|load| inertia.add(&load.inertia));

        let r = &body.rot_link_body;
        let first_moment = r * inertia.first_moment;
        let tensor = r * inertia.inertia_at_origin() * r.transpose();
        let row = &mut parameters[body.joint_idx * N_PARAMETERS..][..N_PARAMETERS];
        row[0] = inertia.mass;
        row[1..4].copy_from_slice(first_moment.as_slice());
        for (entry, at) in row[4..].iter_mut().zip(TENSOR_ENTRIES) {
            *entry = tensor[at];
        }
    }
    parameters
}

/// A body's motion in the axes of its link, which its parameters are given in.
struct LinkState<'a> {
    rot_link_body: &'a Matrix3<f64>,
    state: &'a BodyState,
    omega: Vector3<f64>,
    omega_dot: Vector3<f64>,
}

impl<'a> LinkState<'a> {
    fn new(state: &'a BodyState, rot_link_body: &'a Matrix3<f64>) -> Self {
        Self {
            rot_link_body,
            state,
            omega: rot_link_body * state.omega,
            omega_dot: rot_link_body * state.omega_dot,
        }
    }

    /// Virtual power of the wrenches per unit of the ten parameters, along (w, v).
    ///
    /// ```text
    /// f = m a + U (m c),      n = (m c) × a + I ω̇ + ω × I ω
    /// v·f + w·n = m (v·a) + (m c)·(Uᵀv + a × w) + w·I ω̇ + (w × ω)·I ω
    /// ```
    fn powers(&self, motion: &UnitMotion, entries: &mut [f64]) {
        let (w, v) = (&motion.angular, &motion.linear);
        let (r, BodyState { accel, tensor, .. }) = (self.rot_link_body, self.state);
        entries[0] = v.dot(accel);
        let of_moments = r * (tensor.tr_mul(v) + accel.cross(w));
        entries[1..4].copy_from_slice(of_moments.as_slice());

        let w = r * w;
        let u = w.cross(&self.omega);
        let (d, o) = (&self.omega_dot, &self.omega);
        for (entry, (row, column)) in entries[4..].iter_mut().zip(TENSOR_ENTRIES) {
            *entry = w[row] * d[column] + u[row] * o[column];
            if row != column {
                *entry += w[column] * d[row] + u[column] * o[row];
            }
        }
    }
}
