//! The directions that an arm's parameters are uncertain in, as far as torques show them.
//!
//! ```text
//! w = ŵ + R z,   z ~ N(0, 1),   cov(w) = TᵀT,  T = Q L ᵀ,   R = L U_k
//! ψ_c = ψ̂_c + C z + e,   C = T_ψᵀ Q U_k,   e ~ N(0, V)
//! ```
//! U are the principal directions of the rows at states all over the training ranges, each divided by its noise; as
//! many of them are kept as it takes for at most a given part of the variance of a measurement to be left out.

use faer::{Mat, MatRef};
use linalg::{product, symmetric_eigen};
use puma_dyn::dynamics::N_PARAMETERS;

use crate::error::TorqueError;
use crate::ranges::TrainingRanges;
use crate::rigid_body::low_rank::least_rank;
use crate::rigid_body::online::lanes::{Lanes, N_LANES, ZEROS, plus_scaled};
use crate::rigid_body::online::load_belief::WIDTH;
use crate::rigid_body::online::load_factor::{Square, Ten};
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::prior::LOAD_STD;

/// States whose rows say which directions torques show.
const N_STATES: usize = 512;

/// A load that the model knows, in units of a load's prior.
#[derive(Debug, Clone)]
pub(super) struct KnownLoad {
    /// μ
    pub mean: Ten,
    /// C, direction after direction, (k, 16), zero behind the ten.
    pub coupling: Vec<[f64; WIDTH]>,
    /// V
    pub covariance: Square,
    /// C Cᵀ, zero behind the ten.
    pub spread: [[f64; WIDTH]; N_PARAMETERS],
}

/// R, and the loads that depend on z.
#[derive(Debug, Clone)]
pub(super) struct ArmBasis {
    n_directions: usize,
    /// R, row after row, one for each unknown, (p, chunks); zero behind the directions.
    rows: Vec<Lanes>,
    /// Of each context; `None` where nothing is carried.
    pub loads: Vec<Option<KnownLoad>>,
}

impl ArmBasis {
    /// # Errors
    /// Numbers that overflow.
    pub fn new(
        posterior: &ParameterPosterior,
        ranges: &TrainingRanges,
        left_out: f64,
    ) -> Result<Self, TorqueError> {
        let unknowns = posterior.unknowns();
        let prior_std = &posterior.parts().prior_std;
        let n_of_arm = unknowns.friction(unknowns.n_joints() - 1).end;
        let used: Vec<usize> = (0..n_of_arm).filter(|k| prior_std[*k] > 0.0).collect();
        let qr = posterior.root_of(&used).qr(); // T = Q Lᵀ
        let (q, lt) = (qr.compute_thin_Q(), qr.thin_R());

        let rows = rows_of_states(posterior, &used, &states(posterior, ranges));
        let shown = product(rows.as_ref(), lt.transpose());
        let gram = product(shown.transpose(), shown.as_ref());
        let eigen = symmetric_eigen(gram.as_ref()).map_err(gp_core::GpError::from)?;
        let directions = eigen.vectors.as_ref().reverse_cols(); // largest first
        let parts = product(shown.as_ref(), directions);
        let noise = vec![1.0; parts.nrows()];
        let n_directions = least_rank(&parts, &noise, left_out);

        let kept = directions.subcols(0, n_directions);
        let r = product(lt.transpose(), kept);
        let n_chunks = n_directions.div_ceil(N_LANES);
        let mut rows = vec![ZEROS; n_of_arm * n_chunks];
        for (row, unknown) in used.iter().enumerate() {
            for (col, value) in r.row(row).iter().enumerate() {
                rows[unknown * n_chunks + col / N_LANES][col % N_LANES] = *value;
            }
        }
        let q = product(q.as_ref(), kept);
        let known = |context| {
            let load = posterior.load_of(context)?;
            Some(KnownLoad::new(posterior, load, q.as_ref()))
        };
        Ok(Self {
            n_directions,
            rows,
            loads: (0..posterior.n_contexts()).map(known).collect(),
        })
    }

    /// Number k of directions.
    pub fn n_directions(&self) -> usize {
        self.n_directions
    }

    /// Eights of entries that a row of R has.
    pub fn n_chunks(&self) -> usize {
        self.n_directions.div_ceil(N_LANES)
    }

    /// Σ_u f_u R_u, an eight of entries after another.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn combine(&self, unknowns: &[usize], factors: &[f64], sums: &mut [Lanes]) {
        let n_chunks = sums.len();
        for (chunk, sum) in sums.iter_mut().enumerate() {
            let mut lanes = ZEROS;
            for (unknown, factor) in unknowns.iter().zip(factors) {
                lanes = plus_scaled(lanes, &self.rows[unknown * n_chunks + chunk], *factor);
            }
            *sum = lanes;
        }
    }
}

impl KnownLoad {
    fn new(posterior: &ParameterPosterior, load: usize, q: MatRef<'_, f64>) -> Self {
        let of_load: Vec<usize> = posterior.unknowns().load(load).collect();
        let root = posterior.root_of(&of_load); // T_ψ
        let c = product(root.transpose(), q); // (10, k)
        let rest = &root - product(q, c.transpose());
        let v = product(rest.transpose(), rest.as_ref());
        let mut coupling = vec![[0.0; WIDTH]; c.ncols()];
        for (direction, of_direction) in coupling.iter_mut().enumerate() {
            for (row, std) in LOAD_STD.iter().enumerate() {
                of_direction[row] = c[(row, direction)] / std;
            }
        }
        let mean = &posterior.mean()[posterior.unknowns().load(load)];
        let mut spread = [[0.0; WIDTH]; N_PARAMETERS];
        for direction in &coupling {
            for (to, left) in spread.iter_mut().zip(direction) {
                to.iter_mut()
                    .zip(direction)
                    .for_each(|(to, right)| *to += left * right);
            }
        }
        Self {
            mean: std::array::from_fn(|k| mean[k] / LOAD_STD[k]),
            coupling,
            spread,
            covariance: std::array::from_fn(|row| {
                std::array::from_fn(|col| v[(row, col)] / (LOAD_STD[row] * LOAD_STD[col]))
            }),
        }
    }
}

/// Rows of all joints that were learned at some states, each divided by the noise there, (n, used).
fn rows_of_states(posterior: &ParameterPosterior, used: &[usize], x: &Mat<f64>) -> Mat<f64> {
    let (unknowns, n) = (posterior.unknowns(), x.nrows());
    let joints = posterior.parts().joints.iter().enumerate();
    let seen: Vec<_> = joints
        .filter_map(|(joint, learned)| Some((joint, learned.as_ref().filter(|of| of.is_seen)?)))
        .collect();
    let mut rows = Mat::zeros(n * seen.len(), used.len());
    for (block, (joint, learned)) in seen.into_iter().enumerate() {
        let columns = posterior.joint_rows(joint, None, x.as_ref()).columns;
        for (col, unknown) in unknowns.own(joint).into_iter().enumerate() {
            let Ok(place) = used.binary_search(&unknown) else {
                continue; // fixed
            };
            for row in 0..n {
                let std = learned.noise.std_at(x[(row, unknowns.n_joints() + joint)]);
                rows[(block * n + row, place)] = columns[(row, col)] / std;
            }
        }
    }
    rows
}

/// States (q, q̇, q̈, z) evenly all over the training ranges, z = sgn q̇.
///
/// # Source
/// Roberts 2018, "The unreasonable effectiveness of quasirandom sequences": x_n = n (φ⁻¹, φ⁻², …) mod 1, φ the
/// positive root of φ^(d + 1) = φ + 1.
fn states(posterior: &ParameterPosterior, ranges: &TrainingRanges) -> Mat<f64> {
    let n_joints = posterior.unknowns().n_joints();
    let d = 3 * n_joints;
    let exponent = 1.0 / (d as f64 + 1.0);
    let phi = (0..64).fold(2.0, |phi: f64, _| (1.0 + phi).powf(exponent));
    let steps: Vec<f64> = (0..d)
        .scan(1.0, |step, _| {
            *step /= phi;
            Some(*step)
        })
        .collect();
    let n_covariates = posterior.unknowns().n_covariates();
    let mut x = Mat::zeros(N_STATES, n_covariates);
    for row in 0..N_STATES {
        for (col, step) in steps.iter().enumerate() {
            let part = ((row + 1) as f64 * step).fract();
            let (min, max) = (ranges.min()[col], ranges.max()[col]);
            x[(row, col)] = min + part * (max - min);
        }
        for col in d..n_covariates {
            x[(row, col)] = kernels::sgn(x[(row, n_joints + col % n_joints)]);
        }
    }
    x
}
