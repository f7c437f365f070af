//! A joint of a robot whose parameters all joints and loads share, ready to be asked at one state.

use puma_dyn::robot::{DriveState, FrictionTerm};

use crate::predictor::regressor::{UpperTriangle, upper_factor};
use crate::rigid_body::{JointNoise, SharedJoint};
use linalg::sums::dot_pairwise;

/// A joint in every context.
///
/// ```text
/// mean = y (π̂ + Eψ̂_c) + φᵀθ̂,   var = |T_c (y, φ)|²
/// ```
#[derive(Debug, Clone)]
pub(crate) struct SharedPredictor {
    joint_idx: usize,
    n_joints: usize,
    /// Columns of Y that the joint depends on.
    columns: Vec<usize>,
    /// Friction terms that it keeps, each with the place of its hysteresis state.
    terms: Vec<(FrictionTerm, Option<usize>)>,
    noise: JointNoise,
    of_context: Vec<OfContext>,
}

#[derive(Debug, Clone)]
struct OfContext {
    /// π̂ + Eψ̂, of the columns.
    bodies: Vec<f64>,
    /// θ̂, of the terms.
    friction: Vec<f64>,
    root: UpperTriangle,
}

impl SharedPredictor {
    pub fn new(joint: &SharedJoint) -> Self {
        let (posterior, joint_idx) = (joint.posterior(), joint.joint_idx());
        let unknowns = posterior.unknowns();
        let kept: Vec<usize> = (unknowns.friction(joint_idx).enumerate())
            .filter(|(_, unknown)| posterior.parts().prior_std[*unknown] > 0.0)
            .map(|(term, _)| term)
            .collect();
        let columns = unknowns.bodies_of(joint_idx).to_vec();
        let of_context = |context: usize| {
            let load = posterior.load_of(context);
            let parameters = posterior.body_parameters(context);
            let root = posterior.joint_root(joint_idx, load);
            let places = (0..columns.len()).chain(kept.iter().map(|term| columns.len() + term));
            let places: Vec<usize> = places.collect();
            let own = faer::Mat::from_fn(root.nrows(), places.len(), |row, col| {
                root[(row, places[col])]
            });
            OfContext {
                bodies: columns.iter().map(|column| parameters[*column]).collect(),
                friction: (kept.iter())
                    .map(|term| posterior.mean()[unknowns.friction(joint_idx).start + term])
                    .collect(),
                root: UpperTriangle::of(upper_factor(own.as_ref()).as_ref()),
            }
        };
        Self {
            joint_idx,
            n_joints: unknowns.n_joints(),
            of_context: (0..posterior.n_contexts()).map(of_context).collect(),
            terms: (kept.iter())
                .map(|term| unknowns.terms()[*term])
                .map(|term| (term, unknowns.state_of(term)))
                .collect(),
            noise: *joint.noise(),
            columns,
        }
    }

    /// Scratch entries needed: a row, and T times it.
    pub fn n_scratch(&self) -> usize {
        2 * (self.columns.len() + self.terms.len())
    }

    /// Variance of the noise at a state, N²·m².
    pub fn noise_var(&self, x: &[f64]) -> f64 {
        self.noise.var_at(x[self.n_joints + self.joint_idx])
    }

    /// Mean and latent variance, from the state and the joint's row of Y.
    pub fn predict(
        &self,
        context: usize,
        x: &[f64],
        of_joint: &[f64],
        scratch: &mut [f64],
    ) -> (f64, f64) {
        let n = self.columns.len();
        let (row, product) = scratch.split_at_mut(n + self.terms.len());
        let OfContext {
            bodies,
            friction,
            root,
        } = &self.of_context[context];
        for (entry, column) in row.iter_mut().zip(&self.columns) {
            *entry = of_joint[*column];
        }
        let rigid = dot_pairwise(&row[..n], bodies);
        let (qd, qdd) = (
            x[self.n_joints + self.joint_idx],
            x[2 * self.n_joints + self.joint_idx],
        );
        for (entry, (term, state)) in row[n..].iter_mut().zip(&self.terms) {
            let z = state.map_or(0.0, |k| x[(3 + k) * self.n_joints + self.joint_idx]);
            *entry = term.value(DriveState { qd, qdd, z, rigid });
        }
        let mean = rigid + dot_pairwise(&row[n..], friction);
        (mean, root.squared_norm(row, product))
    }
}
