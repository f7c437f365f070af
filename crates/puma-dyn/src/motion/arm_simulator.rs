//! The motion of an arm under given torques: Runge–Kutta steps between the events of friction.
//!
//! While no joint starts, stops or turns back, the motion is smooth and takes Runge–Kutta steps of
//! order four.
//! A step in which a joint's speed changes sign ends at that very time: the joint's speed is then
//! exactly zero, and [`settle`](crate::motion::stick_slip::settle) decides whether it sticks or goes on.
//! Whether a sticking joint is torn loose is asked at the beginning of every step, so that a motion
//! may start late by a part of a step: its speed is then off by the square of the step at most.
//! The kink of a wall's force at its surface costs the same.
//!
//! Smooth friction is an ordinary torque.
//! A step in which it would change by much falls into pieces; a joint whose friction remembers turns back at an
//! event, even without Coulomb friction, so that its hysteresis state is known exactly from its travel.
//!
//! # Source
//! Acary & Brogliato 2008, *Numerical Methods for Nonsmooth Dynamical Systems*, ch. 8; Hairer, Nørsett
//! & Wanner 1993, *Solving Ordinary Differential Equations I*, sec. II.1 for the step and sec. II.6 for
//! events.

use crate::dynamics::check::check_len;
use crate::dynamics::payload::Context;
use crate::error::DynError;
use crate::motion::compliant_wall::CompliantWall;
use crate::motion::slip_dynamics::{Loaded, SlipDynamics, Stop};
use crate::motion::stick_slip::SlipMode;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;

/// Events after which a single step is given up.
const MOST_EVENTS: usize = 1000;
/// Length of the bracket of an event, as a part of the step, at which it is found.
const EVENT_WIDTH: f64 = 1e-12;
/// Part of a step below which a joint that has started turns back at once: it sticks.
const NO_PROGRESS: f64 = 1e-9;

/// Work done since the start, J.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Work {
    /// By the motors on the arm: ∫ τᵀq̇ dt.
    pub motors: f64,
    /// Taken by friction of every kind: ∫ τ_fᵀq̇ dt.
    pub friction: f64,
    /// By the wall on the arm: ∫ τ_eᵀq̇ dt.
    pub wall: f64,
}

/// An arm in motion.
///
/// ```text
/// M q̈ = τ + τ_e − c(q, q̇) − g(q) − B q̇ − f − τ_s          f Coulomb friction, set-valued at rest; τ_s smooth
/// ```
/// ```
/// use puma_dyn::motion::ArmSimulator;
/// use puma_dyn::{Context, Effects, puma560};
///
/// // Shoulder and elbow fall; friction brings them to rest.
/// let model = puma560::model();
/// let q = [0.0, 0.8, 3.1, 0.0, 0.8, 0.0];
/// let mut arm = ArmSimulator::new(&model, Effects::ALL, Context::empty(), &q, &[0.0; 6])?;
/// for _ in 0..100 {
///     arm.advance(&[0.0; 6], 1e-3, 2)?;
/// }
/// assert!(arm.qd()[1] < 0.0 && arm.work().friction > 0.0);
/// # Ok::<(), puma_dyn::DynError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ArmSimulator<'a> {
    dynamics: SlipDynamics<'a>,
    wall: Option<CompliantWall>,
    time: f64,
    state: Vec<f64>, // q, q̇, then the three works
    modes: Vec<SlipMode>,
    held: Vec<bool>,
    scratch: Scratch,
}

/// Memory of a step.
#[derive(Debug, Clone)]
struct Scratch {
    slopes: [Vec<f64>; 4],
    stage: Vec<f64>,
    trial: Vec<f64>,
    external: Vec<f64>,
    columns: Vec<f64>,
}

impl<'a> ArmSimulator<'a> {
    /// An arm in a state at time zero.
    ///
    /// # Shapes
    /// `q`, `qd` (n_joints,), rad and rad/s; m and m/s for sliding joints.
    /// # Errors
    /// [`DynError::FrictionDrives`] for friction that does not act against the motion, as under
    /// [`Friction::Toolbox2008`](crate::Friction) with a negative gear ratio; [`DynError::NonFinite`].
    /// # Panics
    /// If a slice has another length.
    pub fn new(
        model: &'a Model,
        effects: Effects,
        context: Context,
        q: &[f64],
        qd: &[f64],
    ) -> Result<Self, DynError> {
        let n = model.n_joints();
        check_len("q", q, n);
        check_len("qd", qd, n);
        require_finite(model, "position", q)?;
        require_finite(model, "speed", qd)?;
        let n_state = 2 * n + 3;
        let mut state = vec![0.0; n_state];
        state[..n].copy_from_slice(q);
        state[n..2 * n].copy_from_slice(qd);
        let memory = || vec![0.0; n_state];
        Ok(Self {
            dynamics: SlipDynamics::new(model, effects, context, q)?,
            wall: None,
            time: 0.0,
            state,
            modes: vec![SlipMode::Sticking; n],
            held: vec![false; n],
            scratch: Scratch {
                slopes: [memory(), memory(), memory(), memory()],
                stage: memory(),
                trial: memory(),
                external: vec![0.0; n],
                columns: vec![0.0; 6 * n],
            },
        })
    }

    /// The same arm before a wall.
    ///
    /// # Errors
    /// [`DynError::NonFinite`] or [`DynError::OutOfRange`] for numbers that no wall has.
    pub fn with_wall(mut self, wall: CompliantWall) -> Result<Self, DynError> {
        wall.check(self.dynamics.model)?;
        self.wall = Some(wall);
        Ok(self)
    }

    /// Swaps what the arm carries; positions and speeds stay.
    ///
    /// # Panics
    /// At the next step, if a payload belongs to another model.
    pub fn set_context(&mut self, context: Context) {
        self.dynamics.context = context;
    }

    /// The robot.
    pub fn model(&self) -> &'a Model {
        self.dynamics.model
    }

    /// Simulated time, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Positions, (n_joints,), rad or m.
    pub fn q(&self) -> &[f64] {
        &self.state[..self.n_joints()]
    }

    /// Speeds, (n_joints,), rad/s or m/s; exactly zero where a joint sticks.
    pub fn qd(&self) -> &[f64] {
        let n = self.n_joints();
        &self.state[n..2 * n]
    }

    /// What Coulomb friction did to every joint at the end of the last step.
    pub fn modes(&self) -> &[SlipMode] {
        &self.modes
    }

    /// Work done since the start.
    pub fn work(&self) -> Work {
        let n = self.n_joints();
        Work {
            motors: self.state[2 * n],
            friction: self.state[2 * n + 1],
            wall: self.state[2 * n + 2],
        }
    }

    /// Force between tip and wall, N.
    pub fn wall_force(&mut self) -> f64 {
        let n = self.n_joints();
        let (q, rest) = self.state.split_at(n);
        let Scratch {
            columns, external, ..
        } = &mut self.scratch;
        self.wall.as_ref().map_or(0.0, |wall| {
            wall.add_torques(self.dynamics.model, q, &rest[..n], columns, external)
        })
    }

    /// Goes on for `duration` s under constant torques, in `n_steps` equal steps.
    ///
    /// Allocates nothing.
    /// # Shapes
    /// `tau` (n_joints,), N·m or N.
    /// # Errors
    /// [`DynError::NonFinite`] for a torque; [`DynError::Simulation`] if the inertia matrix is singular
    /// or the motion diverges. The arm is then in the state that it had reached.
    /// # Panics
    /// If `tau` has another length.
    pub fn advance(&mut self, tau: &[f64], duration: f64, n_steps: usize) -> Result<(), DynError> {
        check_len("tau", tau, self.n_joints());
        require_finite(self.dynamics.model, "torque", tau)?;
        let start = self.time;
        let step = duration / n_steps as f64;
        for number in 1..=n_steps {
            self.step(tau, step).map_err(|stop| self.error(&stop))?;
            self.time = start + step * number as f64;
        }
        Ok(())
    }

    fn n_joints(&self) -> usize {
        self.modes.len()
    }

    /// One step, in as many equal pieces as friction asks for.
    fn step(&mut self, tau: &[f64], step: f64) -> Result<(), Stop> {
        let Self {
            dynamics,
            wall,
            state,
            scratch,
            ..
        } = self;
        let at = loaded(dynamics.model, wall.as_ref(), state, tau, scratch);
        let n_pieces = dynamics.n_pieces(at, step)?;
        for _ in 0..n_pieces {
            self.piece(tau, step / n_pieces as f64)?;
        }
        Ok(())
    }

    /// A piece of a step, cut where joints stop.
    fn piece(&mut self, tau: &[f64], step: f64) -> Result<(), Stop> {
        self.held.fill(false);
        let mut left = step;
        for _ in 0..MOST_EVENTS {
            self.choose_modes(tau)?;
            self.try_for(tau, left)?;
            if self.least_forward_speed() >= 0.0 {
                self.accept();
                return Ok(());
            }
            let taken = self.locate_event(tau, left)?;
            self.hold_if_no_progress(taken, step);
            self.accept();
            self.stop_joints();
            left -= taken;
            if left <= 0.0 {
                return Ok(());
            }
        }
        Err(Stop::Unsettled)
    }

    fn choose_modes(&mut self, tau: &[f64]) -> Result<(), Stop> {
        let Self {
            dynamics,
            wall,
            state,
            modes,
            held,
            scratch,
            ..
        } = self;
        let at = loaded(dynamics.model, wall.as_ref(), state, tau, scratch);
        dynamics.choose_modes(at, held, modes)
    }

    /// A Runge–Kutta step of length `h` from the state into the trial, in the present modes.
    fn try_for(&mut self, tau: &[f64], h: f64) -> Result<(), Stop> {
        self.scratch.stage.copy_from_slice(&self.state);
        self.slope(tau, 0)?;
        for (stage, part) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
            let Scratch {
                slopes, stage: at, ..
            } = &mut self.scratch;
            let entries = at.iter_mut().zip(&self.state).zip(&slopes[stage - 1]);
            entries.for_each(|((at, from), slope)| *at = from + part * h * slope);
            self.slope(tau, stage)?;
        }
        let Scratch { slopes, trial, .. } = &mut self.scratch;
        let [k1, k2, k3, k4] = slopes;
        for (idx, (trial, from)) in trial.iter_mut().zip(&self.state).enumerate() {
            *trial = from + h / 6.0 * (k1[idx] + 2.0 * (k2[idx] + k3[idx]) + k4[idx]);
        }
        match trial.iter().position(|value| !value.is_finite()) {
            Some(idx) => Err(Stop::Diverged(idx % self.n_joints())),
            None => Ok(()),
        }
    }

    /// Derivative of the state in the stage, by its number.
    fn slope(&mut self, tau: &[f64], number: usize) -> Result<(), Stop> {
        let n = self.n_joints();
        let Self {
            dynamics,
            wall,
            modes,
            scratch,
            ..
        } = self;
        let mut slope = std::mem::take(&mut scratch.slopes[number]);
        let stage = std::mem::take(&mut scratch.stage);
        let at = loaded(dynamics.model, wall.as_ref(), &stage, tau, scratch);
        let friction = dynamics.accelerations(at, modes, &mut slope[n..2 * n]);
        let power = |torques: &[f64]| torques.iter().zip(at.qd).map(|(t, qd)| t * qd).sum();
        slope[2 * n] = power(at.tau);
        slope[2 * n + 2] = power(at.external);
        slope[..n].copy_from_slice(at.qd);
        scratch.stage = stage;
        scratch.slopes[number] = slope;
        scratch.slopes[number][2 * n + 1] = friction?;
        Ok(())
    }

    /// The least of the trial's speeds in the direction of the joints' modes.
    fn least_forward_speed(&self) -> f64 {
        let n = self.n_joints();
        let joints = self.modes.iter().zip(&self.scratch.trial[n..2 * n]);
        joints
            .map(|(mode, qd)| mode.forward_speed(*qd))
            .fold(f64::INFINITY, f64::min)
    }

    /// Finds the time at which the first joint stops, by the regula falsi of Illinois, and leaves the
    /// trial there.
    fn locate_event(&mut self, tau: &[f64], h: f64) -> Result<f64, Stop> {
        let n = self.n_joints();
        let joints = self.modes.iter().zip(&self.state[n..2 * n]);
        let speeds = joints.map(|(mode, qd)| mode.forward_speed(*qd));
        let (mut low, mut at_low) = (0.0, speeds.fold(f64::INFINITY, f64::min));
        let (mut high, mut at_high) = (h, self.least_forward_speed());
        let mut was_low = None;
        while high - low > EVENT_WIDTH * h && at_high < 0.0 {
            let by_secant = low + (high - low) * at_low / (at_low - at_high);
            let is_inside = by_secant > low && by_secant < high;
            let middle = if is_inside {
                by_secant
            } else {
                0.5 * (low + high)
            };
            if middle <= low || middle >= high {
                break; // the bracket has no number inside
            }
            self.try_for(tau, middle)?;
            let at_middle = self.least_forward_speed();
            let is_low = at_middle > 0.0;
            let is_repeated = was_low == Some(is_low);
            if is_low {
                (low, at_low) = (middle, at_middle);
                at_high *= if is_repeated { 0.5 } else { 1.0 };
            } else {
                (high, at_high) = (middle, at_middle);
                at_low *= if is_repeated { 0.5 } else { 1.0 };
            }
            was_low = Some(is_low);
        }
        self.try_for(tau, high)?;
        Ok(high)
    }

    /// A joint at rest that turns back as soon as it starts is held for the rest of the step.
    fn hold_if_no_progress(&mut self, taken: f64, step: f64) {
        if taken > NO_PROGRESS * step {
            return;
        }
        let n = self.n_joints();
        let speeds = self.state[n..2 * n]
            .iter()
            .zip(&self.scratch.trial[n..2 * n]);
        for ((held, mode), (before, after)) in self.held.iter_mut().zip(&self.modes).zip(speeds) {
            let was_at_rest = before.abs() <= 0.0;
            *held |= was_at_rest && mode.forward_speed(*after) <= 0.0;
        }
    }

    fn accept(&mut self) {
        self.state.copy_from_slice(&self.scratch.trial);
        let n = self.n_joints();
        self.dynamics.memory.begin(&self.state[..n], &self.modes);
    }

    /// The joints that have reached zero speed are at rest.
    fn stop_joints(&mut self) {
        let n = self.n_joints();
        for (mode, qd) in self.modes.iter().zip(&mut self.state[n..2 * n]) {
            if mode.forward_speed(*qd) <= 0.0 {
                *qd = 0.0;
            }
        }
    }

    fn error(&self, stop: &Stop) -> DynError {
        let name = |joint: usize| self.dynamics.model.joint_names()[joint].clone();
        let reason = match *stop {
            Stop::Singular(joint) => {
                format!("the inertia matrix is singular at joint `{}`", name(joint))
            }
            Stop::Diverged(joint) => format!(
                "the motion of joint `{}` grows beyond all bounds",
                name(joint)
            ),
            Stop::SelfLocking(joint, share) => format!(
                "friction of the load is {share} times the load at joint `{}`, which locks itself",
                name(joint)
            ),
            Stop::Stiff(n) => format!(
                "friction changes so fast that a step would fall into {n} pieces; take shorter steps"
            ),
            Stop::Unsettled => "no state of rest and motion of the joints fits friction".to_owned(),
        };
        DynError::Simulation {
            time: self.time,
            reason,
        }
    }
}

/// What acts on the arm in a state, the wall's torques worked out into the scratch.
fn loaded<'s>(
    model: &Model,
    wall: Option<&CompliantWall>,
    state: &'s [f64],
    tau: &'s [f64],
    scratch: &'s mut Scratch,
) -> Loaded<'s> {
    let n = tau.len();
    let (q, qd) = (&state[..n], &state[n..2 * n]);
    if let Some(wall) = wall {
        scratch.external.fill(0.0);
        wall.add_torques(model, q, qd, &mut scratch.columns, &mut scratch.external);
    }
    Loaded {
        q,
        qd,
        tau,
        external: &scratch.external,
    }
}

/// # Errors
/// [`DynError::NonFinite`] with the joint.
fn require_finite(model: &Model, quantity: &'static str, values: &[f64]) -> Result<(), DynError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(joint) => Err(DynError::NonFinite {
            what: "joint",
            name: model.joint_names()[joint].clone(),
            quantity,
            value: values[joint],
        }),
    }
}
