//! The rows that one state and its torques make: a joint's deviation, the arm's directions, the load's columns.
//!
//! ```text
//! y = κ (Yπ̂ + Eψ) + φᵀθ̂ + A z + ε,   κ = 1 + sgn(τ^rb) Σ θ̂_k ∂φ_k/∂|τ^rb|
//! ```
//! Friction that grows with the load is linear in the load as long as the joint's torque keeps its sign, which is
//! taken from the load as it is known; sums without such terms have κ = 1.

use std::sync::Arc;

use linalg::sums::dot_in_lanes;
use puma_dyn::dynamics::N_PARAMETERS;
use puma_dyn::robot::{DriveState, FrictionTerm};
use puma_dyn::{Model, Workspace, regressor};

use crate::rigid_body::log::{FORGETTING_WAY, LONGEST_STEP, STANDING_SECONDS, STANDING_SPEED};
use crate::rigid_body::noise::JointNoise;
use crate::rigid_body::online::arm_basis::ArmBasis;
use crate::rigid_body::online::load_factor::{Ten, inner};
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::prior::LOAD_STD;

/// A joint's row at a tick, divided by its noise.
#[derive(Debug, Clone)]
pub(super) struct JointRow {
    /// A, (stride,).
    pub arm: Vec<f64>,
    /// y − κYπ̂ − φᵀθ̂.
    residual: f64,
    /// κE.
    columns: Ten,
    /// Of the noise, N²·m².
    pub log_var: f64,
    /// Whether it counts.
    pub counts: bool,
}

impl JointRow {
    /// The residual, and then the load's columns.
    #[inline]
    pub fn datum(&self, column: usize) -> f64 {
        match column.checked_sub(1) {
            None => self.residual,
            Some(of_load) => self.columns[of_load],
        }
    }
}

/// What a joint's row is made of.
#[derive(Debug, Clone)]
struct Joint {
    joint_idx: usize,
    /// Columns of Y that the joint depends on.
    bodies: Vec<usize>,
    /// Friction terms with θ̂, each with its unknown and the place of its hysteresis state.
    terms: Vec<(FrictionTerm, f64, usize, Option<usize>)>,
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
    pub fn new(posterior: &ParameterPosterior, stride: usize) -> Self {
        let parts = posterior.parts();
        let parameters = posterior.body_parameters_with(None);
        let joints: Vec<Joint> = (0..parts.joints.len())
            .filter_map(|joint| Joint::new(posterior, joint))
            .collect();
        let row = JointRow {
            arm: vec![0.0; stride],
            residual: 0.0,
            columns: [0.0; N_PARAMETERS],
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
    pub fn fill(&mut self, basis: &ArmBasis, (x, torques, step): (&[f64], &[f64], f64), load: &Ten) {
        let n = self.robot.n_joints();
        let (q, rest) = x.split_at(n);
        let (qd, rest) = rest.split_at(n);
        let (qdd, z) = rest.split_at(n);
        regressor(&self.robot, &mut self.workspace, q, qd, qdd, &mut self.matrix);
        let spacing = self.training_step.map_or(1.0, |training| step / training);
        let length = self.parameters.len();
        for (joint, row) in self.joints.iter_mut().zip(&mut self.rows) {
            let at = joint.joint_idx;
            row.counts = joint.moves(qd[at], step);
            let state = JointState {
                y: &self.matrix[at * length..][..length],
                qd: qd[at],
                qdd: qdd[at],
                z: (z, n),
                torque: torques[at],
                spacing,
            };
            joint.fill(row, basis, &self.parameters, &state, load);
        }
    }

    /// Torques with a load and the arm's deviation, N·m, by the joint.
    pub fn predict_into(&self, load: &Ten, arm: &[f64], torques: &mut [f64]) {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (joint, row) in self.joints.iter().zip(&self.rows) {
                    let deviation = inner(&row.columns, load) + dot_in_lanes(&row.arm, arm);
                    torques[joint.joint_idx] = joint.without_load + joint.std * deviation;
                }
            },
        );
    }
}

/// One joint of a state.
struct JointState<'a> {
    /// Its row of Y.
    y: &'a [f64],
    qd: f64,
    qdd: f64,
    /// Hysteresis states of all ℓ joints, length after length, and ℓ.
    z: (&'a [f64], usize),
    torque: f64,
    spacing: f64,
}

impl Joint {
    fn new(posterior: &ParameterPosterior, joint_idx: usize) -> Option<Self> {
        let (parts, unknowns) = (posterior.parts(), posterior.unknowns());
        let learned = parts.joints[joint_idx].as_ref().filter(|of| of.is_seen)?;
        let terms = unknowns.terms().iter().zip(unknowns.friction(joint_idx));
        let kept = terms.filter(|(_, unknown)| parts.prior_std[*unknown] > 0.0);
        Some(Self {
            joint_idx,
            bodies: unknowns.bodies_of(joint_idx).to_vec(),
            terms: kept
                .map(|(term, unknown)| {
                    let coefficient = posterior.mean()[unknown];
                    (*term, coefficient, unknown, unknowns.state_of(*term))
                })
                .collect(),
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

    fn fill(
        &mut self,
        row: &mut JointRow,
        basis: &ArmBasis,
        parameters: &[f64],
        state: &JointState<'_>,
        load: &Ten,
    ) {
        let y = state.y;
        let carrier = y.len() - N_PARAMETERS;
        let arm: f64 = self.bodies.iter().map(|of| y[*of] * parameters[*of]).sum();
        let mut columns: Ten = std::array::from_fn(|k| y[carrier + k] * LOAD_STD[k]);
        let rigid = arm + inner(&columns, load);
        self.std = self.noise.weighted_var_at(state.qd, state.spacing).sqrt();
        let inverse = 1.0 / self.std;
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let (mut plain, mut slope) = (0.0, 0.0);
                row.arm.fill(0.0);
                for (term, coefficient, unknown, place) in &self.terms {
                    let (z, n) = state.z;
                    let drive = DriveState {
                        qd: state.qd,
                        qdd: state.qdd,
                        z: place.map_or(0.0, |place| z[place * n + self.joint_idx]),
                        rigid: 1.0,
                    };
                    let mut value = term.value(drive);
                    if term.is_of_load() {
                        slope += coefficient * value;
                        value *= rigid.abs();
                    } else {
                        plain += coefficient * value;
                    }
                    add(&mut row.arm, value * inverse, basis.row(*unknown));
                }
                let kappa = 1.0 + kernels::sgn(rigid) * slope;
                for body in &self.bodies {
                    add(&mut row.arm, kappa * y[*body] * inverse, basis.row(*body));
                }
                self.without_load = kappa * arm + plain;
                columns.iter_mut().for_each(|entry| *entry *= kappa * inverse);
            },
        );
        row.columns = columns;
        row.residual = (state.torque - self.without_load) * inverse;
        row.log_var = 2.0 * self.std.ln();
    }
}

/// to + factor × vector.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
fn add(to: &mut [f64], factor: f64, vector: &[f64]) {
    to.iter_mut().zip(vector).for_each(|(to, entry)| *to += factor * entry);
}
