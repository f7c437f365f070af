//! A joint's torque at single states in a context: its mean, its variance, its noise.
//!
//! ```text
//! mean = Y(π̂ + Eψ̂_c) + φᵀθ̂,   var = aᵀ cov a,   a = (Y, φ, Y_E)
//! ```

use std::sync::Arc;

use faer::{Mat, MatRef};
use linalg::sums::dot;
use puma_dyn::robot::{DriveState, FrictionTerm};
use puma_dyn::{Model, Workspace, regressor};

use crate::error::TorqueError;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::unknowns::Unknowns;
use crate::rows::{require_context, require_finite};

/// The rows of states in a context that one joint's equations have.
#[derive(Debug, Clone)]
pub(crate) struct JointRows {
    /// Columns of π that the joint depends on, then φ with τ^rb at the posterior mean, (n, p_j).
    pub columns: Mat<f64>,
    /// Yπ₀, N·m.
    pub described: Vec<f64>,
    /// Speeds of the joint, rad/s.
    pub qd: Vec<f64>,
}

/// The robot at one state after another.
#[derive(Debug)]
pub(crate) struct StateRows<'a> {
    unknowns: &'a Unknowns,
    workspace: Workspace,
    robot: &'a Arc<Model>,
    /// Y, (ℓ, 10 ℓ).
    regressor: Vec<f64>,
}

impl<'a> StateRows<'a> {
    pub fn new(posterior: &'a ParameterPosterior) -> Self {
        let robot = &posterior.parts().robot;
        let n_joints = robot.n_joints();
        Self {
            unknowns: posterior.unknowns(),
            workspace: Workspace::new(robot),
            robot,
            regressor: vec![0.0; n_joints * posterior.parts().described.len()],
        }
    }

    /// Takes a state (q, q̇, q̈, z).
    pub fn take(&mut self, x: &[f64]) {
        let n = self.robot.n_joints();
        let (q, qd, qdd) = (&x[..n], &x[n..2 * n], &x[2 * n..3 * n]);
        regressor(
            self.robot,
            &mut self.workspace,
            q,
            qd,
            qdd,
            &mut self.regressor,
        );
    }

    /// The joint's row of Y.
    pub fn y(&self, joint: usize) -> &[f64] {
        let n = self.unknowns.bodies().len();
        &self.regressor[joint * n..(joint + 1) * n]
    }

    /// φ of a joint at the state taken, with its rigid-body torque.
    pub fn friction(&self, joint: usize, x: &[f64], rigid: f64) -> impl Iterator<Item = f64> + '_ {
        let states = states_of(self.unknowns, joint, x);
        self.unknowns
            .terms()
            .iter()
            .map(move |term| states(*term, rigid))
    }
}

/// φ of a joint at a state, term by term.
fn states_of<'a>(
    unknowns: &'a Unknowns,
    joint: usize,
    x: &[f64],
) -> impl Fn(FrictionTerm, f64) -> f64 + use<'a> {
    let n = unknowns.n_joints();
    let (qd, qdd) = (x[n + joint], x[2 * n + joint]);
    let z: Vec<f64> = (0..unknowns.lengths().len())
        .map(|k| x[(3 + k) * n + joint])
        .collect();
    move |term, rigid| {
        let z = unknowns.state_of(term).map_or(0.0, |state| z[state]);
        term.value(DriveState { qd, qdd, z, rigid })
    }
}

impl ParameterPosterior {
    /// A joint's rows at states in a context.
    pub(crate) fn joint_rows(
        &self,
        joint: usize,
        load: Option<usize>,
        x: MatRef<'_, f64>,
    ) -> JointRows {
        let unknowns = self.unknowns();
        let parameters = self.body_parameters_with(load);
        let bodies = unknowns.bodies_of(joint);
        let mut rows = JointRows {
            columns: Mat::zeros(x.nrows(), bodies.len() + unknowns.terms().len()),
            described: Vec::with_capacity(x.nrows()),
            qd: Vec::with_capacity(x.nrows()),
        };
        let mut states = StateRows::new(self);
        for row in 0..x.nrows() {
            let state: Vec<f64> = x.row(row).iter().copied().collect();
            states.take(&state);
            let y = states.y(joint);
            let rigid = dot(y, &parameters);
            rows.described.push(dot(y, &self.parts().described));
            rows.qd.push(state[unknowns.n_joints() + joint]);
            let of_bodies = bodies.iter().map(|column| y[*column]);
            let entries = of_bodies.chain(states.friction(joint, &state, rigid));
            for (col, entry) in entries.enumerate() {
                rows.columns[(row, col)] = entry;
            }
        }
        rows
    }

    /// Means and variances of a joint's torque at states in a context, N·m and N²·m².
    ///
    /// # Shapes
    /// `x` (n, 3ℓ + ℓ for each length of hysteresis), columns (q, q̇, q̈, z).
    /// # Errors
    /// States that are not finite or of another robot, a context that there is not.
    pub fn predict_joint(
        &self,
        joint: usize,
        context: usize,
        x: MatRef<'_, f64>,
    ) -> Result<(Vec<f64>, Vec<f64>), TorqueError> {
        require_context(context, self.n_contexts())?;
        require_finite(x, self.unknowns().n_covariates())?;
        let load = self.load_of(context);
        let rows = self.joint_rows(joint, load, x);
        let weights = self.joint_mean(joint, load);
        let root = self.joint_root(joint, load);
        let spread = linalg::product(root.as_ref(), rows.columns.transpose());
        let mean = (0..x.nrows()).map(|row| {
            let explained: f64 = (weights.iter().enumerate())
                .map(|(col, w)| w * rows.columns[(row, col)])
                .sum();
            rows.described[row] + explained
        });
        let var = spread.col_iter().map(|column| column.squared_norm_l2());
        Ok((mean.collect(), var.collect()))
    }

    /// Posterior mean of what a joint's own columns multiply, (p_j,): π̂ − π₀ + Eψ̂ and θ̂.
    pub(crate) fn joint_mean(&self, joint: usize, load: Option<usize>) -> Vec<f64> {
        let unknowns = self.unknowns();
        let own = unknowns.own(joint);
        let mut mean: Vec<f64> = own.iter().map(|unknown| self.mean()[*unknown]).collect();
        if let (Some(load), Some(carrier)) = (load, unknowns.carrier_of(joint)) {
            let psi = &self.mean()[unknowns.load(load)];
            mean[carrier]
                .iter_mut()
                .zip(psi)
                .for_each(|(mean, psi)| *mean += psi);
        }
        mean
    }

    /// T with TᵀT their covariance, (p, p_j).
    pub(crate) fn joint_root(&self, joint: usize, load: Option<usize>) -> Mat<f64> {
        let unknowns = self.unknowns();
        let mut root = self.root_of(&unknowns.own(joint));
        if let (Some(load), Some(carrier)) = (load, unknowns.carrier_of(joint)) {
            let of_load: Vec<usize> = unknowns.load(load).collect();
            let of_load = self.root_of(&of_load);
            for (col, of_load) in carrier.zip(of_load.col_iter()) {
                let mut column = root.col_mut(col);
                column += of_load;
            }
        }
        root
    }

    /// Entries of a state's row for some unknowns, (k, 1).
    #[cfg(test)]
    pub(crate) fn row_of(
        &self,
        joint: usize,
        context: usize,
        state: MatRef<'_, f64>,
        unknowns: &[usize],
    ) -> Mat<f64> {
        let load = self.load_of(context);
        let rows = self.joint_rows(joint, load, state);
        let own = self.unknowns().own(joint);
        let carrier = self.unknowns().carrier_of(joint).map_or(0, |of| of.start);
        let entry = |unknown: usize| {
            let place = own.iter().position(|of| *of == unknown);
            let first = load.map_or(0, |load| self.unknowns().load(load).start);
            rows.columns[(0, place.unwrap_or_else(|| carrier + unknown - first))]
        };
        Mat::from_fn(unknowns.len(), 1, |row, _| entry(unknowns[row]))
    }
}
