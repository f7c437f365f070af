//! A joint's torque at single states in a context: its mean, its variance, its noise.
//!
//! ```text
//! mean = Y(π̂ + Eψ̂_c) + φᵀθ̂,   var = aᵀ cov a,   a = (Y, φ, Y_E)
//! ```

use faer::{Mat, MatRef};
use linalg::sums::dot;
use puma_dyn::{Workspace, regressor};

use crate::error::TorqueError;
use crate::prediction::copy_row;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rows::{require_context, require_finite};

/// What a state says of one joint, whatever the context.
struct StateRow<'a> {
    /// The joint's row of Y, (10 ℓ,).
    y: &'a [f64],
    /// q̇ and q̈ of the joint.
    rates: (f64, f64),
    /// Of all joints.
    z: &'a [f64],
}

/// The rows of states in a context that one joint's equations have.
#[derive(Debug, Clone)]
pub(crate) struct JointRows {
    /// Columns of π that the joint depends on, then φ with τ^rb at the posterior mean, (n, p_j).
    pub columns: Mat<f64>,
    /// Yπ₀, N·m.
    pub described: Vec<f64>,
}

/// wᵀa.
fn explained(weights: &[f64], entries: impl Iterator<Item = f64>) -> f64 {
    let products = weights.iter().zip(entries).map(|(w, entry)| w * entry);
    products.sum()
}

impl ParameterPosterior {
    /// A joint's rows at states in a context.
    pub(crate) fn joint_rows(
        &self,
        joint: usize,
        load: Option<usize>,
        x: MatRef<'_, f64>,
    ) -> JointRows {
        let (unknowns, parts) = (self.unknowns(), self.parts());
        let parameters = self.body_parameters_with(load);
        let bodies = unknowns.bodies_of(joint);
        let mut rows = JointRows {
            columns: Mat::zeros(x.nrows(), bodies.len() + unknowns.terms().len()),
            described: Vec::with_capacity(x.nrows()),
        };
        self.for_each_state(joint, x, |row, state| {
            rows.described.push(dot(state.y, &parts.described));
            let entries = self.entries(joint, &state, dot(state.y, &parameters));
            for (col, entry) in entries.enumerate() {
                rows.columns[(row, col)] = entry;
            }
        });
        rows
    }

    /// Y of a joint and what else counts, state by state.
    fn for_each_state(
        &self,
        joint: usize,
        x: MatRef<'_, f64>,
        mut visit: impl FnMut(usize, StateRow<'_>),
    ) {
        let (robot, n) = (&self.parts().robot, self.unknowns().n_joints());
        let p = self.parts().described.len();
        let mut workspace = Workspace::new(robot);
        let mut matrix = vec![0.0; n * p];
        let mut state = vec![0.0; x.ncols()];
        for row in 0..x.nrows() {
            copy_row(x, row, &mut state);
            let (q, rest) = state.split_at(n);
            let (qd, rest) = rest.split_at(n);
            let (qdd, z) = rest.split_at(n);
            regressor(robot, &mut workspace, q, qd, qdd, &mut matrix);
            let y = &matrix[joint * p..][..p];
            let rates = (qd[joint], qdd[joint]);
            visit(row, StateRow { y, rates, z });
        }
    }

    /// Columns of π that the joint depends on, then φ with the rigid body's torque given.
    fn entries<'a>(
        &'a self,
        joint: usize,
        state: &StateRow<'a>,
        rigid: f64,
    ) -> impl Iterator<Item = f64> + 'a {
        let unknowns = self.unknowns();
        let (y, bodies) = (state.y, unknowns.bodies_of(joint));
        let friction = unknowns.friction_row(joint, state.rates, state.z, rigid);
        bodies.iter().map(|column| y[*column]).chain(friction)
    }

    /// Means of a joint's torque at states in every context, N·m: those of [`Self::predict_joint`] to the bit, with one
    /// look at each state.
    ///
    /// # Shapes
    /// `x` as there; (n, contexts).
    /// # Errors
    /// States that are not finite or of another robot.
    pub fn predict_mean_in_all_contexts(
        &self,
        joint: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, TorqueError> {
        require_finite(x, self.unknowns().n_covariates())?;
        let of_context = |context: usize| {
            let load = self.load_of(context);
            let weights = self.unknowns().own_weights(joint, self.mean(), load);
            (self.body_parameters_with(load), weights)
        };
        let contexts: Vec<(Vec<f64>, Vec<f64>)> = (0..self.n_contexts()).map(of_context).collect();
        let mut means = Mat::zeros(x.nrows(), contexts.len());
        self.for_each_state(joint, x, |row, state| {
            let described = dot(state.y, &self.parts().described);
            for (context, (parameters, weights)) in contexts.iter().enumerate() {
                let entries = self.entries(joint, &state, dot(state.y, parameters));
                means[(row, context)] = described + explained(weights, entries);
            }
        });
        Ok(means)
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
        let weights = self.unknowns().own_weights(joint, self.mean(), load);
        let root = self.joint_root(joint, load);
        let spread = linalg::product(root.as_ref(), rows.columns.transpose());
        let mean = (0..x.nrows()).map(|row| {
            let entries = rows.columns.row(row).iter().copied();
            rows.described[row] + explained(&weights, entries)
        });
        let var = spread.col_iter().map(|column| column.squared_norm_l2());
        Ok((mean.collect(), var.collect()))
    }

    /// T with TᵀT the covariance of what a joint's own columns multiply, (p, p_j).
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
