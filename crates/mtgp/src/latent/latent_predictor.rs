//! The latent functions of eq. (16) at one state after another, without allocating.

use faer::MatRef;
use gp_core::Posterior;
use kernels::{ContinuousJoints, TorqueParams, sgn};
use linalg::sums::dot_in_lanes;
use linalg::{TriangularRows, exp_in_place};

use crate::error::MtgpError;
use crate::latent::whitening::{points_of, whitening};
use crate::prior::MultiTaskCovariance;

/// What a posterior has learned of one joint, laid out for one state at a time.
///
/// The same numbers as [`crate::latent::LatentFunctions`], in O(b² r) per state for b basis points:
/// one product with one triangular matrix T, whichever factors the posterior has.
/// ```text
/// M_c = K_Bcᵀ β,   S_cc′(x, y) = δ_cc′ c^x(x, y) − v_c(x)ᵀ v_c′(y),   v_c = T K_Bc
/// ```
#[derive(Debug, Clone)]
pub(crate) struct LatentPredictor {
    continuous: ContinuousJoints,
    n_joints: usize,
    params: TorqueParams,      // one entry per column of z
    points: Vec<f64>,          // (b, columns of z), column after column
    signs: Vec<f64>,           // (b, ℓ), column after column, or empty
    loading: Vec<f64>,         // (b, r), column after column: Λ of each point's task
    weights: Vec<f64>,         // (b,)
    whitening: TriangularRows, // T, (b, b)
    rank: usize,
}

/// The latent functions at one state, in memory that is used again.
#[derive(Debug, Clone)]
pub(crate) struct LatentSample {
    z: Vec<f64>,     // the state, embedded
    k: Vec<f64>,     // (b,), c^x(B, x)
    cross: Vec<f64>, // (b, r), K_Bc = Λ_c ∘ k
    v: Vec<f64>,     // (b, r), T K_Bc
    /// M, (r,).
    pub mean: Vec<f64>,
}

impl LatentPredictor {
    /// # Errors
    /// [`gp_core::GpError::NotPositiveDefinite`] if a factor of the posterior is not finite.
    pub fn new(posterior: &Posterior<MultiTaskCovariance>) -> Result<Self, MtgpError> {
        let prior = posterior.covariance();
        let params = prior.input().embedded_params();
        let (continuous, n_joints) = (prior.input().continuous(), prior.input().n_joints());
        let (points, tasks) = points_of(posterior);
        let embedded = continuous.embed(points);
        let points = embedded.as_ref();
        let root = prior.task().root();
        let n_signs = params.coulomb_std.as_ref().map_or(0, Vec::len);
        let velocities = points.subcols(n_joints, n_signs);
        let loading = |c| tasks.iter().map(move |&task| (task, c));
        Ok(Self {
            continuous: continuous.clone(),
            n_joints,
            params,
            points: columns_of(points),
            signs: columns_of(velocities).into_iter().map(sgn).collect(),
            loading: (0..root.ncols())
                .flat_map(loading)
                .map(|place| root[place])
                .collect(),
            weights: posterior.basis().weights.clone(),
            whitening: whitening(posterior)?,
            rank: root.ncols(),
        })
    }

    /// Number of covariates d.
    pub fn n_covariates(&self) -> usize {
        3 * self.n_joints
    }

    /// Memory for one state.
    pub fn sample(&self) -> LatentSample {
        let n = self.weights.len() * self.rank;
        LatentSample {
            z: vec![0.0; self.params.linear_std.len()],
            k: vec![0.0; self.weights.len()],
            cross: vec![0.0; n],
            v: vec![0.0; n],
            mean: vec![0.0; self.rank],
        }
    }

    /// Fills the memory for a state.
    pub fn visit(&self, x: &[f64], sample: &mut LatentSample) {
        self.continuous.embed_state(x, &mut sample.z);
        let arch = pulp::Arch::new();
        let n = self.weights.len();
        arch.dispatch(
            #[inline(always)]
            || self.fill_features(&sample.z, &mut sample.k, &mut sample.v[..n]),
        );
        exp_in_place(&mut sample.v[..n]);
        arch.dispatch(
            #[inline(always)]
            || self.condition(sample),
        );
    }

    /// Completes k, and fills all that follows from it.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn condition(&self, sample: &mut LatentSample) {
        let n = self.weights.len();
        let signal_var = self.params.signal_std * self.params.signal_std;
        for (k, correlation) in sample.k.iter_mut().zip(&sample.v) {
            *k += signal_var * correlation;
        }
        for c in 0..self.rank {
            let loading = &self.loading[c * n..(c + 1) * n];
            let cross = &mut sample.cross[c * n..(c + 1) * n];
            for ((cross, loading), k) in cross.iter_mut().zip(loading).zip(&sample.k) {
                *cross = loading * k;
            }
            sample.mean[c] = dot_in_lanes(cross, &self.weights);
        }
        self.whitening.multiply(&sample.cross, &mut sample.v);
    }

    /// Writes all terms of c^x(B, x) but the squared exponential to `k`, and the exponents of that.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn fill_features(&self, z: &[f64], k: &mut [f64], exponents: &mut [f64]) {
        let (n, params) = (self.weights.len(), &self.params);
        k.fill(params.bias_std * params.bias_std);
        exponents.fill(0.0);
        for (j, (linear, length)) in
            (params.linear_std.iter().zip(&params.length_scales)).enumerate()
        {
            let weighted = linear * linear * z[j];
            let precision = -0.5 / (length * length);
            let points = &self.points[j * n..(j + 1) * n];
            for ((exponent, k), point) in exponents.iter_mut().zip(k.iter_mut()).zip(points) {
                let difference = z[j] - point;
                *exponent += precision * (difference * difference);
                *k += weighted * point;
            }
        }
        for (j, coulomb) in params.coulomb_std.iter().flatten().enumerate() {
            let weighted = coulomb * coulomb * sgn(z[self.n_joints + j]);
            for (k, sign) in k.iter_mut().zip(&self.signs[j * n..(j + 1) * n]) {
                *k += weighted * sign;
            }
        }
    }

    /// Writes the posterior covariances S_cc′ of f_c at one state and f_c′ at another, (r, r).
    pub fn covariance(&self, first: &LatentSample, second: &LatentSample, out: &mut [f64]) {
        let prior = self.prior(&first.z, &second.z);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || self.fill_covariance(prior, &first.v, &second.v, out),
        );
    }

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn fill_covariance(&self, prior: f64, first: &[f64], second: &[f64], out: &mut [f64]) {
        let n = self.weights.len();
        let part = |c: usize| c * n..(c + 1) * n;
        for c in 0..self.rank {
            for other in 0..self.rank {
                let known = dot_in_lanes(&first[part(c)], &second[part(other)]);
                out[c * self.rank + other] = if c == other { prior - known } else { -known };
            }
        }
    }

    /// c^x of embedded states.
    fn prior(&self, first: &[f64], second: &[f64]) -> f64 {
        let params = &self.params;
        let (mut sum, mut exponent) = (params.bias_std * params.bias_std, 0.0);
        for (j, (linear, length)) in
            (params.linear_std.iter().zip(&params.length_scales)).enumerate()
        {
            let scaled = (first[j] - second[j]) / length;
            exponent -= 0.5 * scaled * scaled;
            sum += linear * linear * first[j] * second[j];
        }
        let n_joints = self.n_joints;
        for (j, coulomb) in params.coulomb_std.iter().flatten().enumerate() {
            sum += coulomb * coulomb * sgn(first[n_joints + j]) * sgn(second[n_joints + j]);
        }
        sum + params.signal_std * params.signal_std * f64::exp(exponent)
    }
}

/// The entries of a matrix, column after column.
fn columns_of(matrix: MatRef<'_, f64>) -> Vec<f64> {
    let columns = matrix.col_iter();
    columns.flat_map(|column| column.iter().copied()).collect()
}
