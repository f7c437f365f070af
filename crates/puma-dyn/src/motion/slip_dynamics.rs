//! Forward dynamics while every joint keeps its slip mode: smooth, with sticking joints locked.
//!
//! ```text
//! M q̈ = τ + τ_e − c(q, q̇) − g(q) − B q̇ − f         q̈_i = 0 and f_i a reaction for sticking joints
//! ```
//! Rows and columns of sticking joints are replaced by those of the identity, and the rest is solved
//! by Cholesky's method.
//!
//! Smooth friction is one more torque, with a part s of the load, which is what the gear hands on:
//!
//! ```text
//! load = M q̈ + c + g − τ_e          without rotors
//! τ − B q̇ − f − own = load (1 + σ s) + G² Jm q̈,          σ = sgn load
//! ```
//! Divided by 1 + σ s it is the same system with another torque and rotor; σ is guessed until it is found again.

use crate::dynamics::crba::crba;
use crate::dynamics::friction::smooth_torque;
use crate::dynamics::hysteresis::Memory;
use crate::dynamics::payload::Context;
use crate::dynamics::rnea::rnea;
use crate::dynamics::workspace::Workspace;
use crate::error::DynError;
use crate::motion::stick_slip::{SlipMode, settle};
use crate::motion::travel_memory::TravelMemory;
use crate::robot::friction_law::{Effects, Friction, Law};
use crate::robot::model::Model;
use crate::robot::smooth_friction::SmoothTorque;

/// Guesses of the loads' signs after which the search is given up; two or three are usual.
const MOST_SIGNS: usize = 100;
/// By how much of itself friction may change within a piece of a step: well inside what the method bears.
const LARGEST_CHANGE: f64 = 0.5;
/// Pieces of a step beyond which it is refused.
const MOST_PIECES: f64 = 1000.0;

/// Why a step cannot be taken; turned into an error with the time and the joint's name.
pub(crate) enum Stop {
    /// The inertia matrix is singular at a joint.
    Singular(usize),
    /// No modes, or no signs of the loads, fit friction.
    Unsettled,
    /// The motion of a joint grows beyond all bounds.
    Diverged(usize),
    /// Friction takes all of the load of a joint: the part of it.
    SelfLocking(usize, f64),
    /// Friction changes too fast for the step: the number of steps that it asks for.
    Stiff(f64),
}

/// The arm with its friction laws, and the scratch to find its accelerations.
#[derive(Debug, Clone)]
pub(crate) struct SlipDynamics<'a> {
    pub model: &'a Model,
    pub context: Context,
    rigid: Effects,
    friction: Friction,
    laws: Vec<Law>,
    pub memory: TravelMemory,
    smooth: Vec<SmoothTorque>, // (n,), at the state
    load_signs: Vec<f64>,      // (n,)
    bounds: Vec<(f64, f64)>,   // (n,), of friction at rest
    bias: Vec<f64>,            // (n,), c + g
    factor: Vec<f64>,          // (n, n)
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
    /// The arm at `q`, where friction has no past.
    ///
    /// # Errors
    /// [`DynError::FrictionDrives`].
    pub fn new(
        model: &'a Model,
        effects: Effects,
        context: Context,
        q: &[f64],
    ) -> Result<Self, DynError> {
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
            friction: effects.friction,
            memory: TravelMemory::new(model.springs(), q),
            smooth: vec![SmoothTorque::NONE; n],
            load_signs: vec![1.0; n],
            bounds: laws.iter().map(Law::at_rest).collect(),
            bias: vec![0.0; n],
            factor: vec![0.0; n * n],
            laws,
            workspace: Workspace::new(model),
            inertia_matrix: vec![0.0; n * n],
            drive: vec![0.0; n],
            solution: vec![0.0; n],
            resting: vec![None; n],
        })
    }

    /// Whether there is friction beyond viscous and Coulomb.
    fn has_smooth_friction(&self) -> bool {
        self.friction != Friction::None && self.model.has_smooth_friction()
    }

    /// Sets the mode of every joint; a joint that is `held` sticks if it is at rest.
    pub fn choose_modes(
        &mut self,
        at: Loaded<'_>,
        held: &[bool],
        modes: &mut [SlipMode],
    ) -> Result<(), Stop> {
        self.memory.rewind();
        self.modes_of_moving(at);
        if self.resting.iter().any(Option::is_none) {
            self.set_system(at)?;
            let mut is_settled = false;
            for _ in 0..MOST_SIGNS {
                self.settle_modes(at, held)?;
                if self.signs_stay(|this, idx| this.load_by_inertia(at, idx)) {
                    is_settled = true;
                    break;
                }
                self.modes_of_moving(at);
            }
            if !is_settled {
                return Err(Stop::Unsettled);
            }
        }
        for (mode, settled) in modes.iter_mut().zip(&self.resting) {
            *mode = settled.unwrap_or(SlipMode::Sticking);
        }
        Ok(())
    }

    /// The modes of joints that move; `None` for those at rest.
    fn modes_of_moving(&mut self, at: Loaded<'_>) {
        for (idx, mode) in self.resting.iter_mut().enumerate() {
            let has_memory =
                self.friction != Friction::None && self.model.smooth_friction()[idx].has_memory();
            *mode = SlipMode::of_moving(&self.laws[idx], has_memory, at.qd[idx]);
        }
    }

    /// Decides for the joints at rest, under the loads' signs as they are guessed.
    fn settle_modes(&mut self, at: Loaded<'_>, held: &[bool]) -> Result<(), Stop> {
        for (idx, is_held) in held.iter().enumerate() {
            let mode = &mut self.resting[idx];
            if mode.is_none() && *is_held {
                *mode = Some(SlipMode::Sticking);
            }
            let coulomb = mode.map_or(0.0, |mode| mode.coulomb(&self.laws[idx]));
            self.load_system(at, idx, coulomb);
            let share = self.share(idx);
            let (negative, positive) = self.laws[idx].at_rest();
            self.bounds[idx] = (negative / share, positive / share);
        }
        let stuck = |mode: &Option<SlipMode>| *mode == Some(SlipMode::Sticking);
        lock(&mut self.factor, &mut self.drive, |idx| {
            stuck(&self.resting[idx])
        });
        let (modes, scratch) = (&mut self.resting, &mut self.solution);
        if settle(&self.factor, &self.drive, &self.bounds, modes, scratch) {
            Ok(())
        } else {
            Err(Stop::Unsettled)
        }
    }

    /// Accelerations in given modes, and the power that friction takes, W.
    pub fn accelerations(
        &mut self,
        at: Loaded<'_>,
        modes: &[SlipMode],
        qdd: &mut [f64],
    ) -> Result<f64, Stop> {
        self.memory.follow(at.q, modes);
        self.set_system(at)?;
        for _ in 0..MOST_SIGNS {
            for (idx, mode) in modes.iter().enumerate() {
                self.load_system(at, idx, mode.coulomb(&self.laws[idx]));
            }
            lock(&mut self.factor, &mut self.drive, |idx| {
                modes[idx] == SlipMode::Sticking
            });
            solve_in_place(&mut self.factor, &mut self.drive).map_err(Stop::Singular)?;
            qdd.copy_from_slice(&self.drive);
            self.solution.copy_from_slice(qdd);
            let is_settled = self.signs_stay(|this, idx| match modes[idx] {
                // Friction of a joint that sticks is a reaction: its sign is of no account.
                SlipMode::Sticking => this.load_signs[idx],
                mode => this.load_by_torque(at, idx, mode),
            });
            if is_settled {
                return Ok(self.friction_power(at, modes));
            }
        }
        Err(Stop::Unsettled)
    }

    /// Power that friction takes in the modes, at the accelerations of the solution, W.
    fn friction_power(&self, at: Loaded<'_>, modes: &[SlipMode]) -> f64 {
        let has_smooth = self.has_smooth_friction();
        let mut power = 0.0;
        for (idx, (law, mode)) in self.laws.iter().zip(modes).enumerate() {
            let qd = at.qd[idx];
            let mut torque = mode.coulomb(law) + law.viscous() * qd;
            if has_smooth {
                torque += self.smooth[idx].under(self.load_by_torque(at, idx, *mode));
            }
            power += torque * qd;
        }
        power
    }

    /// How many pieces a step of length `h` falls into, so that friction changes little within each.
    ///
    /// Friction that changes by d with speed and by k with travel has rates of at most Σ d/I and √(Σ k/I),
    /// with 1/I the diagonal of M⁻¹: traces bound the largest eigenvalue.
    pub fn n_pieces(&mut self, at: Loaded<'_>, h: f64) -> Result<usize, Stop> {
        if !self.has_smooth_friction() {
            return Ok(1);
        }
        self.memory.rewind();
        self.set_system(at)?;
        let (mut damping, mut stiffness) = (0.0, 0.0);
        for idx in 0..self.laws.len() {
            let load = self.bias[idx].abs() + at.tau[idx].abs() + at.external[idx].abs();
            let (of_speed, of_travel) = self.model.smooth_friction()[idx].slopes(load);
            self.factor.copy_from_slice(&self.inertia_matrix);
            self.solution.fill(0.0);
            self.solution[idx] = 1.0;
            solve_in_place(&mut self.factor, &mut self.solution).map_err(Stop::Singular)?;
            damping += self.solution[idx] * of_speed;
            stiffness += self.solution[idx] * of_travel;
        }
        let n = (h * (damping + f64::sqrt(stiffness)) / LARGEST_CHANGE).ceil();
        if n > MOST_PIECES {
            return Err(Stop::Stiff(n));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number of at most MOST_PIECES"
        )]
        let n = n.max(1.0) as usize;
        Ok(n)
    }

    /// M, c + g, and smooth friction.
    fn set_system(&mut self, at: Loaded<'_>) -> Result<(), Stop> {
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
        let bias = &mut self.bias;
        rnea(model, workspace, *rigid, context, at.q, at.qd, &zeros, bias);
        workspace.zeros = zeros;
        if self.has_smooth_friction() {
            let memory = Memory::States(self.memory.states());
            for (idx, smooth) in self.smooth.iter_mut().enumerate() {
                *smooth = smooth_torque(self.model, self.friction, memory, idx, at.qd[idx]);
                let is_full = smooth.share.is_nan() || smooth.share.abs() >= 1.0;
                if is_full && at.qd[idx].is_finite() {
                    return Err(Stop::SelfLocking(idx, smooth.share));
                }
            }
        }
        Ok(())
    }

    /// Row of the system of a joint, the first joint first: τ + τ_e − c − g − B q̇ − f on its right, under the guessed sign of its load.
    fn load_system(&mut self, at: Loaded<'_>, idx: usize, coulomb: f64) {
        let n = self.laws.len();
        if idx == 0 {
            self.factor.copy_from_slice(&self.inertia_matrix);
        }
        let viscous = self.laws[idx].viscous() * at.qd[idx];
        let mut drive = at.tau[idx] + at.external[idx] - self.bias[idx] - viscous;
        drive -= coulomb;
        if self.has_smooth_friction() {
            let own = self.smooth[idx].own;
            let more = self.share(idx).recip() - 1.0;
            drive += more * (at.tau[idx] - viscous - coulomb - own) - own;
            self.factor[idx * n + idx] += more * self.rotor_inertia(idx);
        }
        self.drive[idx] = drive;
    }

    /// 1 + σ s.
    fn share(&self, idx: usize) -> f64 {
        1.0 + self.load_signs[idx] * self.smooth[idx].share
    }

    fn rotor_inertia(&self, idx: usize) -> f64 {
        if self.rigid.rotor_inertia {
            self.model.rotor_inertias()[idx]
        } else {
            0.0
        }
    }

    /// Takes the signs of the loads over; whether those that matter were guessed.
    fn signs_stay(&mut self, load: impl Fn(&Self, usize) -> f64) -> bool {
        if !self.has_smooth_friction() {
            return true;
        }
        let mut do_stay = true;
        for idx in 0..self.laws.len() {
            let sign = load(self, idx).signum();
            let matters = self.smooth[idx].share.abs() > 0.0;
            do_stay &= !matters || (sign - self.load_signs[idx]).abs() < 1.0;
            self.load_signs[idx] = sign;
        }
        do_stay
    }

    /// Load of a joint by its own torque balance, at the accelerations of the solution.
    fn load_by_torque(&self, at: Loaded<'_>, idx: usize, mode: SlipMode) -> f64 {
        let law = &self.laws[idx];
        let friction = law.viscous() * at.qd[idx] + mode.coulomb(law) + self.smooth[idx].own;
        let left = at.tau[idx] - friction - self.rotor_inertia(idx) * self.solution[idx];
        left / self.share(idx)
    }

    /// The same by what it moves, which holds for joints that stick as well.
    fn load_by_inertia(&self, at: Loaded<'_>, idx: usize) -> f64 {
        let n = self.laws.len();
        let row = &self.inertia_matrix[idx * n..(idx + 1) * n];
        let inertial: f64 = row.iter().zip(&self.solution).map(|(m, a)| m * a).sum();
        let rotor = self.rotor_inertia(idx) * self.solution[idx];
        inertial - rotor + self.bias[idx] - at.external[idx]
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
