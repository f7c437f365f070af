//! Ticks of a controller: how time is cut up, and what happened from one to the next.

use crate::motion::reference_motion::JointState;

/// What happened from one tick to the next.
#[derive(Debug, Clone, Copy)]
pub struct Tick<'a> {
    /// Time since the start of the reference, s.
    pub time: f64,
    /// State to be followed at that time.
    pub desired: &'a JointState,
    /// Positions at that time, (n_joints,), rad or m.
    pub q: &'a [f64],
    /// Speeds at that time, rad/s or m/s.
    pub qd: &'a [f64],
    /// Torques held until the next tick, N·m or N.
    pub tau: &'a [f64],
    /// The part of them that is feed-forward.
    pub feed_forward: &'a [f64],
    /// Positions at the next tick.
    pub next_q: &'a [f64],
    /// Speeds at the next tick.
    pub next_qd: &'a [f64],
    /// Force between tip and wall at the next tick, N.
    pub wall_force: f64,
}

/// How time is cut up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// From one tick of the controller to the next, s.
    pub period: f64,
    /// Steps of the integration in that time.
    pub n_steps: usize,
}
