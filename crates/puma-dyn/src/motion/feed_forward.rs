//! Torques that a controller applies before there is any error: from nothing, gravity, a model, or
//! whatever was learned.

use crate::dynamics::hysteresis::Hysteresis;
use crate::dynamics::payload::Context;
use crate::dynamics::rnea::rnea_with_hysteresis;
use crate::dynamics::terms::gravity_torques;
use crate::dynamics::workspace::Workspace;
use crate::motion::reference_motion::JointState;
use crate::motion::tick::Tick;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;

/// Torques for a desired state: τ_ff of sec. 1.
///
/// A closure `FnMut(&JointState, &mut [f64])` is one: wrap a learned predictor in it.
/// A torque that is not finite stops the simulation with the joint's name.
pub trait FeedForward {
    /// Writes the torques for a desired state, (n_joints,), N·m.
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]);

    /// Hears what came of them, after every tick; for what adapts itself.
    fn observe(&mut self, _tick: &Tick<'_>) {}
}

impl<F: FnMut(&JointState, &mut [f64])> FeedForward for F {
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]) {
        self(desired, tau);
    }
}

/// No feed-forward: what is left is a PD controller.
#[derive(Debug, Clone, Copy)]
pub struct NoFeedForward;

impl FeedForward for NoFeedForward {
    fn torques(&mut self, _desired: &JointState, tau: &mut [f64]) {
        tau.fill(0.0);
    }
}

/// What holds the arm still at the desired position, and no more.
#[derive(Debug, Clone)]
pub struct GravityFeedForward<'a> {
    model: &'a Model,
    context: Context,
    workspace: Workspace,
}

impl<'a> GravityFeedForward<'a> {
    /// For an arm that is believed to carry `context`.
    pub fn new(model: &'a Model, context: Context) -> Self {
        Self {
            workspace: Workspace::new(model),
            model,
            context,
        }
    }
}

impl FeedForward for GravityFeedForward<'_> {
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]) {
        gravity_torques(
            self.model,
            &mut self.workspace,
            &self.context,
            &desired.q,
            tau,
        );
    }
}

/// The torques of a dynamics model, friction included where `effects` says so.
///
/// Friction with memory follows the desired motion from one call to the next; before the first, it has no past.
#[derive(Debug, Clone)]
pub struct ModelFeedForward<'a> {
    model: &'a Model,
    effects: Effects,
    context: Context,
    workspace: Workspace,
    hysteresis: Hysteresis,
    last_q: Vec<f64>,
    has_begun: bool,
}

impl<'a> ModelFeedForward<'a> {
    /// For an arm that is believed to carry `context`.
    pub fn new(model: &'a Model, effects: Effects, context: Context) -> Self {
        Self {
            workspace: Workspace::new(model),
            hysteresis: Hysteresis::new(model),
            last_q: vec![0.0; model.n_joints()],
            has_begun: false,
            model,
            effects,
            context,
        }
    }
}

impl FeedForward for ModelFeedForward<'_> {
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]) {
        let JointState { q, qd, qdd } = desired;
        if self.has_begun {
            self.hysteresis.travel(&self.last_q, q);
        }
        self.last_q.copy_from_slice(q);
        self.has_begun = true;
        let workspace = &mut self.workspace;
        rnea_with_hysteresis(
            self.model,
            workspace,
            self.effects,
            &self.context,
            &self.hysteresis,
            q,
            qd,
            qdd,
            tau,
        );
    }
}
