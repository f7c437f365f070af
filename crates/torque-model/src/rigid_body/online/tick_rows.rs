//! The rows that one state and its torques make: a joint's deviation, the arm's directions, the load's columns.
//!
//! ```text
//! y = κ (Yπ̂ + Eψ) + φᵀθ̂ + A z + ε,   κ = 1 + sgn(τ^rb) Σ θ̂_k ∂φ_k/∂|τ^rb|
//! ```
//! Friction that grows with the load is linear in the load as long as the joint's torque keeps its sign, which is
//! taken from the load as it is known; sums without such terms have κ = 1.

use std::sync::Arc;

use puma_dyn::dynamics::N_PARAMETERS;
use puma_dyn::robot::{DriveState, FrictionTerm};
use puma_dyn::{Model, Workspace, regressor};

use crate::rigid_body::log::{FORGETTING_WAY, LONGEST_STEP, STANDING_SECONDS, STANDING_SPEED};
use crate::rigid_body::noise::JointNoise;
use crate::rigid_body::online::arm_basis::ArmBasis;
use crate::rigid_body::online::lanes::{Lanes, ZEROS, dot};
use crate::rigid_body::online::load_belief::WIDTH;
use crate::rigid_body::online::load_factor::{Ten, inner};
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::prior::LOAD_STD;

/// A joint's row at a tick, divided by its noise.
#[derive(Debug, Clone)]
pub(super) struct JointRow {
    /// A, (chunks,).
    pub arm: Vec<Lanes>,
    /// y − κYπ̂ − φᵀθ̂, κE, and zeros.
    pub data: [f64; WIDTH],
    /// Of the noise, N²·m².
    pub log_var: f64,
    /// Whether it counts.
    pub counts: bool,
}

/// What a joint's row is made of.
#[derive(Debug, Clone)]
struct Joint {
    number: usize,
    /// Columns of Y that the joint depends on.
    bodies: Vec<usize>,
    /// Friction terms with θ̂, each with the place of its hysteresis state.
    terms: Vec<(FrictionTerm, f64, Option<usize>)>,
    /// The unknowns of bodies and terms, and what each multiplies in the row at hand.
    unknowns: Vec<usize>,
    factors: Vec<f64>,
    noise: JointNoise,
    /// Seconds since it last moved.
    still_for: f64,
    /// Way since the beginning, rad.
    way: f64,
    /// κYπ̂ + φᵀθ̂ and the root of the noise's variance.
    without_load: f64,
    std: f64,
}

/// The rows of one tick.
#[derive(Debug, Clone)]
pub(super) struct TickRows {
    robot: Arc<Model>,
    /// π̂ without a load.
    parameters: Vec<f64>,
    /// Median step of the training data, s.
    training_step: Option<f64>,
    joints: Vec<Joint>,
    workspace: Workspace,
    /// Y, row after row.
    matrix: Vec<f64>,
    /// Of the joints that were learned.
    pub rows: Vec<JointRow>,
}

impl TickRows {
    pub fn new(posterior: &ParameterPosterior, n_chunks: usize) -> Self {
        let parts = posterior.parts();
        let parameters = posterior.body_parameters_with(None);
        let joints: Vec<Joint> = (0..parts.joints.len())
            .filter_map(|joint| Joint::new(posterior, joint))
            .collect();
        let row = JointRow {
            arm: vec![ZEROS; n_chunks],
            data: [0.0; WIDTH],
            log_var: 0.0,
            counts: false,
        };
        Self {
            workspace: Workspace::new(&parts.robot),
            matrix: vec![0.0; parts.joints.len() * parameters.len()],
            rows: vec![row; joints.len()],
            robot: Arc::clone(&parts.robot),
            training_step: parts.step,
            parameters,
            joints,
        }
    }

    /// Makes the rows of a state, its torques and the time since the one before, with a load in units of its prior.
    pub fn fill(
        &mut self,
        basis: &ArmBasis,
        (x, torques, step): (&[f64], &[f64], f64),
        load: &Ten,
    ) {
        let n = self.robot.n_joints();
        let (q, rest) = x.split_at(n);
        let (qd, rest) = rest.split_at(n);
        let (qdd, z) = rest.split_at(n);
        regressor(
            &self.robot,
            &mut self.workspace,
            q,
            qd,
            qdd,
            &mut self.matrix,
        );
        let spacing = self.training_step.map_or(1.0, |training| step / training);
        let length = self.parameters.len();
        for (joint, row) in self.joints.iter_mut().zip(&mut self.rows) {
            let at = joint.number;
            row.counts = joint.moves(qd[at], step);
            pulp::Arch::new().dispatch(Filling {
                joint,
                row,
                basis,
                parameters: &self.parameters,
                y: &self.matrix[at * length..][..length],
                z: (z, n),
                drive: DriveState {
                    qd: qd[at],
                    qdd: qdd[at],
                    z: 0.0,
                    rigid: 1.0,
                },
                torque: torques[at],
                spacing,
                load,
            });
        }
    }

    /// The first joint whose row is so large that it overflows.
    pub fn overflow(&self) -> Option<usize> {
        let is_finite = |row: &JointRow| {
            let squares = dot(&row.arm, &row.arm) + linalg::sums::dot(&row.data, &row.data);
            (squares + row.log_var).is_finite()
        };
        let place = self.rows.iter().position(|row| !is_finite(row))?;
        Some(self.joints[place].number)
    }

    /// Torques with a load and the arm's deviation, N·m, by the joint.
    pub fn predict_into(&self, load: &Ten, arm: &[Lanes], torques: &mut [f64]) {
        for (joint, row) in self.joints.iter().zip(&self.rows) {
            let of_load = linalg::sums::dot_in_sequence(&row.data[1..], load);
            let deviation = of_load + dot(&row.arm, arm);
            torques[joint.number] = joint.without_load + joint.std * deviation;
        }
    }
}

/// A joint's row to be made, compiled once per instruction set.
struct Filling<'a> {
    joint: &'a mut Joint,
    row: &'a mut JointRow,
    basis: &'a ArmBasis,
    parameters: &'a [f64],
    /// Its row of Y.
    y: &'a [f64],
    /// Hysteresis states of all ℓ joints, length after length, and ℓ.
    z: (&'a [f64], usize),
    /// q̇ and q̈; |τ^rb| = 1, so that terms of the load are what it is multiplied by.
    drive: DriveState,
    torque: f64,
    spacing: f64,
    load: &'a Ten,
}

impl Joint {
    fn new(posterior: &ParameterPosterior, joint_idx: usize) -> Option<Self> {
        let (parts, unknowns) = (posterior.parts(), posterior.unknowns());
        let learned = parts.joints[joint_idx].as_ref().filter(|of| of.is_seen)?;
        let terms = unknowns.terms().iter().zip(unknowns.friction(joint_idx));
        let kept = terms.filter(|(_, unknown)| parts.prior_std[*unknown] > 0.0);
        let bodies = unknowns.bodies_of(joint_idx);
        let of_terms = kept.clone().map(|(_, unknown)| unknown);
        let own: Vec<usize> = bodies.iter().copied().chain(of_terms).collect();
        Some(Self {
            number: joint_idx,
            bodies: bodies.to_vec(),
            terms: kept
                .map(|(term, unknown)| (*term, posterior.mean()[unknown], unknowns.state_of(*term)))
                .collect(),
            factors: vec![0.0; own.len()],
            unknowns: own,
            noise: learned.noise,
            still_for: f64::INFINITY,
            way: 0.0,
            without_load: 0.0,
            std: 1.0,
        })
    }

    /// Whether the joint has moved within half a second, and 6 mrad since the beginning: [`crate::rigid_body::log`]'s
    /// rule without a look ahead.
    fn moves(&mut self, qd: f64, step: f64) -> bool {
        if qd.abs() >= STANDING_SPEED {
            self.still_for = 0.0;
            self.way += qd.abs() * step;
        } else {
            self.still_for += step;
        }
        let stands = self.still_for > STANDING_SECONDS || self.way < FORGETTING_WAY;
        step > LONGEST_STEP || !stands
    }
}

impl pulp::NullaryFnOnce for Filling<'_> {
    type Output = ();

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn call(self) {
        let Self {
            joint, row, basis, ..
        } = self;
        let (y, carrier) = (self.y, self.y.len() - N_PARAMETERS);
        let bodies = joint.bodies.iter();
        let arm: f64 = bodies.map(|of| y[*of] * self.parameters[*of]).sum();
        let columns: Ten = std::array::from_fn(|k| y[carrier + k] * LOAD_STD[k]);
        let rigid = arm + inner(&columns, self.load);
        let var = joint.noise.weighted_var_at(self.drive.qd, self.spacing);
        joint.std = var.sqrt();
        let inverse = 1.0 / joint.std;

        let (mut plain, mut slope) = (0.0, 0.0);
        let (of_bodies, of_terms) = joint.factors.split_at_mut(joint.bodies.len());
        for ((term, coefficient, place), factor) in joint.terms.iter().zip(of_terms) {
            let (z, n) = self.z;
            let z = place.map_or(0.0, |place| z[place * n + joint.number]);
            let mut value = term.value(DriveState { z, ..self.drive });
            if term.is_of_load() {
                slope += coefficient * value;
                value *= rigid.abs();
            } else {
                plain += coefficient * value;
            }
            *factor = value * inverse;
        }
        let kappa = 1.0 + kernels::sgn(rigid) * slope;
        for (body, factor) in joint.bodies.iter().zip(of_bodies) {
            *factor = kappa * y[*body] * inverse;
        }
        basis.combine(&joint.unknowns, &joint.factors, &mut row.arm);

        joint.without_load = kappa * arm + plain;
        row.data[0] = (self.torque - joint.without_load) * inverse;
        for (to, entry) in row.data[1..].iter_mut().zip(columns) {
            *to = kappa * inverse * entry;
        }
        row.log_var = var.ln();
    }
}
