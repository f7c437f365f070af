//! Forward dynamics while every joint keeps its slip mode: smooth, with sticking joints locked.
//!
//! ```text
//! M q̈ = τ + τ_e − c(q, q̇) − g(q) − B q̇ − f         q̈_i = 0 and f_i a reaction for sticking joints
//! ```
//! Rows and columns of sticking joints are replaced by those of the identity, and the rest is solved
//! by Cholesky's method.

use crate::dynamics::crba::crba;
use crate::dynamics::payload::Context;
use crate::dynamics::rnea::rnea;
use crate::dynamics::workspace::Workspace;
use crate::error::DynError;
use crate::motion::stick_slip::{SlipMode, settle};
use crate::robot::friction_law::{Effects, Friction, Law};
use crate::robot::model::Model;

/// The arm with its friction laws, and the scratch to find its accelerations.
#[derive(Debug, Clone)]
pub(crate) struct SlipDynamics<'a> {
    pub model: &'a Model,
    pub context: Context,
    rigid: Effects,
    laws: Vec<Law>,
    workspace: Workspace,
    inertia_matrix: Vec<f64>, // (n, n)
    drive: Vec<f64>,          // (n,), right-hand side
    solution: Vec<f64>,       // (n,)
    resting: Vec<Option<SlipMode>>,
}

/// What acts on an arm in a state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Loaded<'a> {
    pub q: &'a [f64],
    pub qd: &'a [f64],
    /// Of the motors, N·m.
    pub tau: &'a [f64],
    /// Of contacts, N·m.
    pub external: &'a [f64],
}

impl<'a> SlipDynamics<'a> {
    /// # Errors
    /// [`DynError::FrictionDrives`].
    pub fn new(model: &'a Model, effects: Effects, context: Context) -> Result<Self, DynError> {
        let n = model.n_joints();
        let friction = model.joint_friction().iter();
        let laws: Vec<Law> = friction.map(|joint| joint.law(effects.friction)).collect();
        for (law, joint) in laws.iter().zip(model.joint_names()) {
            let (negative, positive) = law.at_rest();
            if negative > 0.0 || positive < 0.0 || law.viscous() < 0.0 {
                return Err(DynError::FrictionDrives {
                    joint: joint.clone(),
                    negative,
                    positive,
                });
            }
        }
        Ok(Self {
            model,
            context,
            rigid: Effects {
                friction: Friction::None,
                ..effects
            },
            laws,
            workspace: Workspace::new(model),
            inertia_matrix: vec![0.0; n * n],
            drive: vec![0.0; n],
            solution: vec![0.0; n],
            resting: vec![None; n],
        })
    }

    /// Sets the mode of every joint; a joint that is `held` sticks if it is at rest.
    ///
    /// # Errors
    /// The joint at which the inertia matrix is singular, or `None` if the search does not settle.
    pub fn choose_modes(
        &mut self,
        at: Loaded<'_>,
        held: &[bool],
        modes: &mut [SlipMode],
    ) -> Result<(), Option<usize>> {
        let joints = self.resting.iter_mut().zip(&self.laws).zip(at.qd);
        for ((mode, law), qd) in joints {
            *mode = SlipMode::of_moving(law, *qd);
        }
        if self.resting.iter().any(Option::is_none) {
            self.set_system(at);
            for (idx, mode) in self.resting.iter_mut().enumerate() {
                match mode {
                    Some(mode) => self.drive[idx] -= mode.coulomb(&self.laws[idx]),
                    None if held[idx] => *mode = Some(SlipMode::Sticking),
                    None => {}
                }
            }
            let stuck = |mode: &Option<SlipMode>| *mode == Some(SlipMode::Sticking);
            lock(&mut self.inertia_matrix, &mut self.drive, |idx| {
                stuck(&self.resting[idx])
            });
            let (matrix, drive) = (&self.inertia_matrix, &self.drive);
            let (modes, scratch) = (&mut self.resting, &mut self.solution);
            if !settle(matrix, drive, &self.laws, modes, scratch) {
                return Err(None);
            }
        }
        for (mode, settled) in modes.iter_mut().zip(&self.resting) {
            *mode = settled.unwrap_or(SlipMode::Sticking);
        }
        Ok(())
    }

    /// Accelerations in given modes, and the power that friction takes, W.
    ///
    /// # Errors
    /// The joint at which the inertia matrix is singular.
    pub fn accelerations(
        &mut self,
        at: Loaded<'_>,
        modes: &[SlipMode],
        qdd: &mut [f64],
    ) -> Result<f64, usize> {
        self.set_system(at);
        let mut power = 0.0;
        let joints = self.drive.iter_mut().zip(&self.laws).zip(modes);
        for (((drive, law), mode), qd) in joints.zip(at.qd) {
            let coulomb = mode.coulomb(law);
            *drive -= coulomb;
            power += (coulomb + law.viscous() * qd) * qd;
        }
        lock(&mut self.inertia_matrix, &mut self.drive, |idx| {
            modes[idx] == SlipMode::Sticking
        });
        solve_in_place(&mut self.inertia_matrix, &mut self.drive)?;
        qdd.copy_from_slice(&self.drive);
        Ok(power)
    }

    /// M and τ + τ_e − c − g − B q̇.
    fn set_system(&mut self, at: Loaded<'_>) {
        let Self {
            model,
            context,
            rigid,
            workspace,
            ..
        } = self;
        crba(
            model,
            workspace,
            *rigid,
            context,
            at.q,
            &mut self.inertia_matrix,
        );
        let zeros = std::mem::take(&mut workspace.zeros);
        let bias = &mut self.drive;
        rnea(model, workspace, *rigid, context, at.q, at.qd, &zeros, bias);
        workspace.zeros = zeros;
        let torques = at.tau.iter().zip(at.external);
        let joints = self.drive.iter_mut().zip(&self.laws).zip(at.qd);
        for (((drive, law), qd), (tau, external)) in joints.zip(torques) {
            *drive = tau + external - *drive - law.viscous() * qd;
        }
    }
}

/// Takes the locked joints out of the system: rows and columns of the identity, nothing to drive them.
fn lock(matrix: &mut [f64], drive: &mut [f64], is_locked: impl Fn(usize) -> bool) {
    let n = drive.len();
    for i in (0..n).filter(|i| is_locked(*i)) {
        for j in 0..n {
            matrix[i * n + j] = 0.0;
            matrix[j * n + i] = 0.0;
        }
        matrix[i * n + i] = 1.0;
        drive[i] = 0.0;
    }
}

/// Solves a symmetric positive-definite system; `matrix` (n, n) becomes its Cholesky factor.
///
/// # Errors
/// The row whose pivot is not positive.
fn solve_in_place(matrix: &mut [f64], rhs: &mut [f64]) -> Result<(), usize> {
    let n = rhs.len();
    for j in 0..n {
        for i in j..n {
            let (row_i, row_j) = (&matrix[i * n..i * n + j], &matrix[j * n..j * n + j]);
            let sum: f64 = row_i.iter().zip(row_j).map(|(a, b)| a * b).sum();
            let left = matrix[i * n + j] - sum;
            if i > j {
                matrix[i * n + j] = left / matrix[j * n + j];
            } else if left > 0.0 {
                matrix[j * n + j] = left.sqrt();
            } else {
                return Err(j);
            }
        }
    }
    for i in 0..n {
        let sum: f64 = (0..i).map(|j| matrix[i * n + j] * rhs[j]).sum();
        rhs[i] = (rhs[i] - sum) / matrix[i * n + i];
    }
    for i in (0..n).rev() {
        let sum: f64 = (i + 1..n).map(|j| matrix[j * n + i] * rhs[j]).sum();
        rhs[i] = (rhs[i] - sum) / matrix[i * n + i];
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_system_worked_by_hand() {
        // (4 2 0; 2 5 2; 0 2 5) (1, −1, 2)ᵀ = (2, 1, 8)ᵀ
        let mut matrix = [4.0, 2.0, 0.0, 2.0, 5.0, 2.0, 0.0, 2.0, 5.0];
        let mut x = [2.0, 1.0, 8.0];
        solve_in_place(&mut matrix, &mut x).unwrap();
        for (x, expected) in x.iter().zip([1.0, -1.0, 2.0]) {
            assert!((x - expected).abs() < 8.0 * f64::EPSILON, "{x} {expected}");
        }
        assert_eq!(
            solve_in_place(&mut [1.0, 2.0, 2.0, 4.0], &mut [0.0; 2]),
            Err(1)
        );
    }
}
