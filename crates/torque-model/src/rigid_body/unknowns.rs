//! The unknowns of a robot's torques, in their order.

use puma_dyn::Model;
use puma_dyn::dynamics::{N_PARAMETERS, parameters_of_joint};
use puma_dyn::robot::{DriveState, FrictionTerm};
use std::ops::Range;

/// What the torques are linear in: w = (π − π₀, θ_1, …, θ_ℓ, ψ_1, …, ψ_K).
///
/// π has ten inertial parameters for the body of each of ℓ joints and is one for all joints;
/// θ_j has a coefficient for each friction term of joint j; ψ_k has the ten parameters of load k,
/// which is carried by the last body.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknowns {
    n_joints: usize,
    terms: Vec<FrictionTerm>,
    lengths: Vec<f64>,
    n_loads: usize,
    /// Parameters of π that each joint's torque depends on, ascending.
    of_joint: Vec<Vec<usize>>,
}

impl Unknowns {
    /// Those of a robot with these friction terms at every joint, without a load.
    pub fn new(robot: &Model, terms: Vec<FrictionTerm>) -> Self {
        let n_joints = robot.n_joints();
        let bodies = N_PARAMETERS * n_joints;
        let of_joint = |joint| {
            let mut columns = parameters_of_joint(robot, joint);
            columns.retain(|column| *column < bodies);
            columns
        };
        let mut lengths: Vec<f64> = terms.iter().filter_map(|term| term.length()).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.dedup();
        Self {
            n_joints,
            terms,
            lengths,
            n_loads: 0,
            of_joint: (0..n_joints).map(of_joint).collect(),
        }
    }

    /// The same with another number of loads.
    #[must_use]
    pub fn with_loads(&self, n_loads: usize) -> Self {
        Self {
            n_loads,
            ..self.clone()
        }
    }

    /// Number of joints ℓ.
    pub fn n_joints(&self) -> usize {
        self.n_joints
    }

    /// Friction terms φ of every joint.
    pub fn terms(&self) -> &[FrictionTerm] {
        &self.terms
    }

    /// Lengths δ of the hysteresis states that the terms need, rad, ascending.
    pub fn lengths(&self) -> &[f64] {
        &self.lengths
    }

    /// Place of a term's length among [`Unknowns::lengths`].
    pub(crate) fn state_of(&self, term: FrictionTerm) -> Option<usize> {
        let length = term.length()?;
        (self.lengths.iter()).position(|known| known.total_cmp(&length).is_eq())
    }

    /// Number of covariates of a state (q, q̇, q̈, z): z has ℓ entries for each length.
    pub fn n_covariates(&self) -> usize {
        (3 + self.lengths.len()) * self.n_joints
    }

    /// Number of loads K.
    pub fn n_loads(&self) -> usize {
        self.n_loads
    }

    /// Whether a term grows with the joint's load.
    pub(crate) fn have_load_friction(&self) -> bool {
        self.terms.iter().any(|term| term.is_of_load())
    }

    /// Number of unknowns p.
    pub fn len(&self) -> usize {
        self.bodies().len() + self.n_joints * self.terms.len() + N_PARAMETERS * self.n_loads
    }

    /// Never: a robot has joints.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Those of the bodies, π − π₀.
    pub fn bodies(&self) -> Range<usize> {
        0..N_PARAMETERS * self.n_joints
    }

    /// Those of a joint's friction.
    pub fn friction(&self, joint: usize) -> Range<usize> {
        let (start, n) = (self.bodies().end, self.terms.len());
        start + joint * n..start + (joint + 1) * n
    }

    /// Those of a load.
    pub fn load(&self, load: usize) -> Range<usize> {
        let start = self.bodies().end + self.n_joints * self.terms.len();
        start + load * N_PARAMETERS..start + (load + 1) * N_PARAMETERS
    }

    /// Those of the body that carries the load.
    pub fn carrier(&self) -> Range<usize> {
        let end = self.bodies().end;
        end - N_PARAMETERS..end
    }

    /// Parameters of π that a joint's torque depends on, ascending.
    pub fn bodies_of(&self, joint: usize) -> &[usize] {
        &self.of_joint[joint]
    }

    /// All unknowns of a joint's own columns: those of bodies, then its friction.
    pub(crate) fn own(&self, joint: usize) -> Vec<usize> {
        (self.of_joint[joint].iter().copied())
            .chain(self.friction(joint))
            .collect()
    }

    /// What a joint's own columns are multiplied by, with the load's part at the body that carries it.
    pub(crate) fn own_weights(&self, joint: usize, w: &[f64], load: Option<usize>) -> Vec<f64> {
        let own = self.own(joint);
        let mut weights: Vec<f64> = own.iter().map(|unknown| w[*unknown]).collect();
        if let (Some(load), Some(carrier)) = (load, self.carrier_of(joint)) {
            let of_load = &w[self.load(load)];
            let at_carrier = weights[carrier].iter_mut().zip(of_load);
            at_carrier.for_each(|(weight, psi)| *weight += psi);
        }
        weights
    }

    /// φ of a joint.
    ///
    /// # Shapes
    /// `z` (lengths, ℓ), as in a state behind (q, q̇, q̈).
    pub(crate) fn friction_row<'a>(
        &'a self,
        joint: usize,
        (qd, qdd): (f64, f64),
        z: &'a [f64],
        rigid: f64,
    ) -> impl Iterator<Item = f64> + 'a {
        self.terms.iter().map(move |term| {
            let state = self.state_of(*term);
            let z = state.map_or(0.0, |state| z[state * self.n_joints + joint]);
            term.value(DriveState { qd, qdd, z, rigid })
        })
    }

    /// Where the carrier's ten stand among [`Unknowns::bodies_of`]; `None` for a joint that does not move it.
    pub(crate) fn carrier_of(&self, joint: usize) -> Option<Range<usize>> {
        let first = self.carrier().start;
        let place = (self.of_joint[joint].iter()).position(|column| *column == first)?;
        Some(place..place + N_PARAMETERS)
    }
}
