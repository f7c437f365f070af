//! The latent functions of eq. (16) at one state after another, without allocating.

use faer::MatRef;
use gp_core::FitPosterior;
use kernels::{TorqueParams, exp_in_place, sgn};

use crate::basis::Basis;
use crate::prior::MultiTaskCovariance;

/// Numbers that are summed side by side, so that a sum is as fast as the memory.
const LANES: usize = 8;

/// What a posterior has learned of one joint, laid out for one state at a time.
///
/// The same numbers as [`crate::LatentFunctions`], in O(b² r) per state for b basis points.
#[derive(Debug, Clone)]
pub(crate) struct LatentPredictor {
    params: TorqueParams,
    points: Vec<f64>,  // (b, d), column after column
    signs: Vec<f64>,   // (b, ℓ), column after column, or empty
    loading: Vec<f64>, // (b, r), column after column: Λ of each point's task
    weights: Vec<f64>, // (b,)
    l: Columns,
    noise: Option<(Columns, f64)>, // Rᵀ and σ², of pivots
    rank: usize,
}

/// The latent functions at one state, in memory that is used again.
#[derive(Debug, Clone)]
pub(crate) struct LatentSample {
    x: Vec<f64>,
    k: Vec<f64>,   // (b,), c^x(B, x)
    phi: Vec<f64>, // (b, r), L⁻¹ (Λ ∘ k)
    rho: Vec<f64>, // (b, r), R⁻ᵀφ, or empty
    /// M, (r,).
    pub mean: Vec<f64>,
}

impl LatentPredictor {
    pub fn new(posterior: &FitPosterior<MultiTaskCovariance>) -> Self {
        let basis = Basis::of(posterior);
        let prior = posterior.covariance();
        let params = prior.input().named_params();
        let (points, tasks) = basis.points();
        let root = prior.task().root();
        let n_signs = params.coulomb_std.as_ref().map_or(0, Vec::len);
        let velocities = points.subcols(prior.input().n_joints(), n_signs);
        let loading = |c| tasks.iter().map(move |&task| (task, c));
        Self {
            params,
            points: columns_of(points),
            signs: columns_of(velocities).into_iter().map(sgn).collect(),
            loading: (0..root.ncols())
                .flat_map(loading)
                .map(|place| root[place])
                .collect(),
            weights: basis.weights().to_vec(),
            l: Columns::of(basis.l()),
            noise: (basis.pivot_noise()).map(|(r, var)| (Columns::of(r.transpose()), var)),
            rank: root.ncols(),
        }
    }

    /// Number of covariates d.
    pub fn n_covariates(&self) -> usize {
        self.params.linear_std.len()
    }

    /// Memory for one state.
    pub fn sample(&self) -> LatentSample {
        let n = self.weights.len() * self.rank;
        LatentSample {
            x: vec![0.0; self.n_covariates()],
            k: vec![0.0; self.weights.len()],
            phi: vec![0.0; n],
            rho: vec![0.0; if self.noise.is_some() { n } else { 0 }],
            mean: vec![0.0; self.rank],
        }
    }

    /// Fills the memory for a state.
    pub fn visit(&self, x: &[f64], sample: &mut LatentSample) {
        let n = self.weights.len();
        sample.x.copy_from_slice(x);
        self.fill_cross(x, &mut sample.k, &mut sample.phi[..n]);
        for c in 0..self.rank {
            let loading = &self.loading[c * n..(c + 1) * n];
            let phi = &mut sample.phi[c * n..(c + 1) * n];
            for ((phi, loading), k) in phi.iter_mut().zip(loading).zip(&sample.k) {
                *phi = loading * k;
            }
            sample.mean[c] = dot(phi, &self.weights);
        }
        self.l.solve_in_place(&mut sample.phi);
        if let Some((r, _)) = &self.noise {
            sample.rho.copy_from_slice(&sample.phi);
            r.solve_in_place(&mut sample.rho);
        }
    }

    /// Writes c^x(B, x) to `k`.
    fn fill_cross(&self, x: &[f64], k: &mut [f64], exponents: &mut [f64]) {
        let (n, params) = (self.weights.len(), &self.params);
        k.fill(params.bias_std * params.bias_std);
        exponents.fill(0.0);
        for (j, (linear, length)) in
            (params.linear_std.iter().zip(&params.length_scales)).enumerate()
        {
            let weighted = linear * linear * x[j];
            let precision = -0.5 / (length * length);
            let points = &self.points[j * n..(j + 1) * n];
            for ((exponent, k), point) in exponents.iter_mut().zip(k.iter_mut()).zip(points) {
                let difference = x[j] - point;
                *exponent += precision * (difference * difference);
                *k += weighted * point;
            }
        }
        let n_joints = x.len() / 3;
        for (j, coulomb) in params.coulomb_std.iter().flatten().enumerate() {
            let weighted = coulomb * coulomb * sgn(x[n_joints + j]);
            for (k, sign) in k.iter_mut().zip(&self.signs[j * n..(j + 1) * n]) {
                *k += weighted * sign;
            }
        }
        exp_in_place(exponents);
        let signal_var = params.signal_std * params.signal_std;
        for (k, correlation) in k.iter_mut().zip(exponents) {
            *k += signal_var * *correlation;
        }
    }

    /// Writes the posterior covariances S_cc′ of f_c at one state and f_c′ at another, (r, r).
    pub fn covariance(&self, first: &LatentSample, second: &LatentSample, out: &mut [f64]) {
        let (n, rank) = (self.weights.len(), self.rank);
        let part = |c: usize| c * n..(c + 1) * n;
        let prior = self.prior(&first.x, &second.x);
        for c in 0..rank {
            for other in 0..rank {
                let known = dot(&first.phi[part(c)], &second.phi[part(other)]);
                let mut value = if c == other { prior - known } else { -known };
                if let Some((_, noise_var)) = &self.noise {
                    value += noise_var * dot(&first.rho[part(c)], &second.rho[part(other)]);
                }
                out[c * rank + other] = value;
            }
        }
    }

    /// c^x(x, y).
    fn prior(&self, x: &[f64], y: &[f64]) -> f64 {
        let params = &self.params;
        let (mut sum, mut exponent) = (params.bias_std * params.bias_std, 0.0);
        for (j, (linear, length)) in
            (params.linear_std.iter().zip(&params.length_scales)).enumerate()
        {
            let scaled = (x[j] - y[j]) / length;
            exponent -= 0.5 * scaled * scaled;
            sum += linear * linear * x[j] * y[j];
        }
        let n_joints = x.len() / 3;
        for (j, coulomb) in params.coulomb_std.iter().flatten().enumerate() {
            sum += coulomb * coulomb * sgn(x[n_joints + j]) * sgn(y[n_joints + j]);
        }
        sum + params.signal_std * params.signal_std * f64::exp(exponent)
    }
}

/// A lower triangular matrix, column after column from the diagonal down.
#[derive(Debug, Clone)]
struct Columns {
    order: usize,
    entries: Vec<f64>,
}

impl Columns {
    fn of(matrix: MatRef<'_, f64>) -> Self {
        let order = matrix.nrows();
        let below = |col: usize| (col..order).map(move |row| matrix[(row, col)]);
        Self {
            order,
            entries: (0..order).flat_map(below).collect(),
        }
    }

    /// Replaces every vector of n entries by the solution; a column is read once for all of them.
    fn solve_in_place(&self, vectors: &mut [f64]) {
        let mut rest = self.entries.as_slice();
        for col in 0..self.order {
            let (column, after) = rest.split_at(self.order - col);
            for vector in vectors.chunks_exact_mut(self.order) {
                let solved = vector[col] / column[0];
                vector[col] = solved;
                for (value, l) in vector[col + 1..].iter_mut().zip(&column[1..]) {
                    *value -= solved * l;
                }
            }
            rest = after;
        }
    }
}

/// The entries of a matrix, column after column.
fn columns_of(matrix: MatRef<'_, f64>) -> Vec<f64> {
    let columns = matrix.col_iter();
    columns.flat_map(|column| column.iter().copied()).collect()
}

/// The sum of products, in a few sums side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a_lanes, b_lanes) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest = a_lanes.remainder().iter().zip(b_lanes.remainder());
    let mut sums = [0.0; LANES];
    for (a, b) in a_lanes.zip(b_lanes) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    sums.iter().sum::<f64>() + rest.map(|(a, b)| a * b).sum::<f64>()
}
