//! The regressor of the drives: rotor inertia and friction are linear in four numbers per joint.
//!
//! ```text
//! τ_j = Y_d(q̇_j, q̈_j) π_d,j      π_d,j = [G² Jm, B, Tc⁺, Tc⁻]      joint side
//! Y_d = [q̈_j, q̇_j, [q̇_j > 0], [q̇_j < 0]]
//! ```
//! Beside the regressor of the bodies it makes the torques of [`crate::rnea`] under any
//! [`crate::Effects`] linear, as long as the robot has no friction beyond viscous and Coulomb, which has terms of
//! its own ([`crate::robot::FrictionTerm`]).
//!
//! # Source
//! Sec. 2.1 for the friction; Khalil & Dombre 2002, *Modeling, Identification and Control of Robots*,
//! sec. 12.3, for drives among the parameters to identify.

use crate::dynamics::check::check_len;
use crate::dynamics::regressor::{N_PARAMETERS, fill_bodies};
use crate::dynamics::workspace::Workspace;
use crate::robot::friction_law::{Effects, Friction, JointFriction, Law};
use crate::robot::model::Model;

/// Drive parameters per joint.
pub const N_DRIVE_PARAMETERS: usize = 4;

/// The four entries of Y_d of one joint; at rest the last two are zero.
///
/// Multiplied with rad/s² and rad/s, the parameters are kg m², N·m·s/rad, N·m and N·m; those of a
/// sliding joint kg, N·s/m, N and N.
#[must_use]
pub fn drive_regressor(qd: f64, qdd: f64) -> [f64; N_DRIVE_PARAMETERS] {
    let step = |is_moving: bool| if is_moving { 1.0 } else { 0.0 };
    [qdd, qd, step(qd > 0.0), step(qd < 0.0)]
}

/// The parameters π_d of a model's drives, as far as `effects` has them, (4 n_joints,).
#[must_use]
pub fn drive_parameters(model: &Model, effects: Effects) -> Vec<f64> {
    let rotors = model.rotor_inertias().iter();
    let drives = rotors.zip(model.joint_friction());
    let of_joint = |(rotor, friction): (&f64, &JointFriction)| {
        let law = match effects.friction {
            Friction::None => None,
            Friction::Modern => Some(&friction.modern),
            Friction::Toolbox2008 => Some(&friction.toolbox_2008),
        };
        let rotor = if effects.rotor_inertia { *rotor } else { 0.0 };
        let [viscous, positive, negative] = law.map_or([0.0; 3], Law::parameters);
        [rotor, viscous, positive, negative]
    };
    drives.flat_map(of_joint).collect()
}

/// The whole matrix Y of `τ = Y π` for π = (bodies, drives), under the model's gravity.
///
/// # Shapes
/// `q`, `qd` and `qdd` (n_joints,); `matrix` (n_joints, 14 n_joints), row after row: the columns of
/// [`crate::regressor`] and then four for the drive of each joint.
///
/// # Panics
/// If a slice has another length, or the workspace belongs to another model.
///
/// # Source
/// Eqs. (10)–(12), for all links and with the drives.
pub fn full_regressor(
    model: &Model,
    workspace: &mut Workspace,
    q: &[f64],
    qd: &[f64],
    qdd: &[f64],
    matrix: &mut [f64],
) {
    let n = model.n_joints();
    let (n_body, n_drive) = (n * N_PARAMETERS, n * N_DRIVE_PARAMETERS);
    let row_length = n_body + n_drive;
    check_len("matrix", matrix, n * row_length);
    matrix.fill(0.0);
    fill_bodies(model, workspace, (q, qd, qdd), matrix, row_length);
    for (joint, row) in matrix.chunks_exact_mut(row_length).enumerate() {
        row[n_body + joint * N_DRIVE_PARAMETERS..][..N_DRIVE_PARAMETERS]
            .copy_from_slice(&drive_regressor(qd[joint], qdd[joint]));
    }
}

/// Columns of [`full_regressor`] that can differ from zero in the row of a joint, ascending.
///
/// Those of the bodies that the joint moves, which are its own and all that it carries, and of its drive.
///
/// # Panics
/// If there is no such joint.
#[must_use]
pub fn parameters_of_joint(model: &Model, joint_idx: usize) -> Vec<usize> {
    let (n, bodies) = (model.n_joints(), model.bodies());
    assert!(joint_idx < n, "joint {joint_idx} of {n}");
    let is_moved = |body_idx: usize| {
        let mut chain = std::iter::successors(Some(body_idx), |&idx| bodies[idx].parent);
        chain.any(|idx| bodies[idx].joint_idx == joint_idx)
    };
    let mut moved: Vec<usize> = (0..bodies.len())
        .filter(|&idx| is_moved(idx))
        .map(|idx| bodies[idx].joint_idx)
        .collect();
    moved.sort_unstable();
    let of_bodies = (moved.into_iter()).flat_map(|j| j * N_PARAMETERS..(j + 1) * N_PARAMETERS);
    let drive = n * N_PARAMETERS + joint_idx * N_DRIVE_PARAMETERS;
    of_bodies.chain(drive..drive + N_DRIVE_PARAMETERS).collect()
}
