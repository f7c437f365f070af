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
use crate::dynamics::workspace::Workspace;
use crate::robot::body::Motion;
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
    let states = &mut workspace.bodies[..];
    propagate(
        model,
        states,
        &-model.gravity_vector(),
        JointStates { q, qd, qdd },
    );
    for (body_idx, body) in model.bodies().iter().enumerate() {
        let wrenches = unit_wrenches(&states[body_idx], &body.rot_link_body);
        let first_column = body.joint_idx * N_PARAMETERS;
        for (column, (force, moment)) in (first_column..).zip(wrenches) {
            let entries = &mut matrix[column..];
            fill_column(
                model,
                states,
                body_idx,
                (force, moment),
                entries,
                row_length,
            );
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

/// Force and moment per unit of each of a body's ten parameters, in the body's axes.
///
/// ```text
/// f = m a + U (m c),      n = (m c) × a + I ω̇ + ω × I ω
/// ```
fn unit_wrenches(
    state: &BodyState,
    rot_link_body: &Matrix3<f64>,
) -> [(Vector3<f64>, Vector3<f64>); N_PARAMETERS] {
    let r = rot_link_body;
    let (omega, omega_dot) = (r * state.omega, r * state.omega_dot); // link axes
    std::array::from_fn(|parameter| match parameter {
        0 => (state.accel, Vector3::zeros()),
        1..4 => {
            let unit: Vector3<f64> = r.row(parameter - 1).transpose(); // a link axis in body axes
            (state.tensor * unit, unit.cross(&state.accel))
        }
        _ => {
            let (row, column) = TENSOR_ENTRIES[parameter - 4];
            let unit_tensor = |v: &Vector3<f64>| {
                let mut product = Vector3::zeros();
                product[row] = v[column];
                product[column] = v[row];
                product
            };
            let moment = unit_tensor(&omega_dot) + omega.cross(&unit_tensor(&omega));
            (Vector3::zeros(), r.tr_mul(&moment))
        }
    })
}

/// Hands a wrench down to the ground and notes each joint's share; `entries` starts at row 0.
fn fill_column(
    model: &Model,
    states: &[BodyState],
    body_idx: usize,
    (mut force, mut moment): (Vector3<f64>, Vector3<f64>),
    entries: &mut [f64],
    row_length: usize,
) {
    let mut next = Some(body_idx);
    while let Some(idx) = next {
        let (body, pose) = (&model.bodies()[idx], &states[idx].pose);
        entries[body.joint_idx * row_length] = match body.motion {
            Motion::Revolute => moment.z,
            Motion::Prismatic => force.z,
        };
        force = pose.rotation * force;
        moment = pose.rotation * moment + pose.translation.cross(&force);
        next = body.parent;
    }
}
