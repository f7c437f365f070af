//! Bounds on the rounding errors of mean and variance of a joint, in the loop and in the batch together.
//!
//! ```text
//! |δk_p| ≤ (d + 2) ε v² max|z|² + (2d + ℓ + 2) ε c̄_p      module docs of the squared exponential; sums of c
//! |δmean| ≤ Σ_p |β_p| (|δk_p| + 2 r ε c̄_p)
//! φ = L⁻¹k:   |δ|φ|²| ≤ 2 |a|ᵀ(|δk| + 2 r ε |L||φ|) + 2 r ε |φ|²,   a = L⁻ᵀφ
//! ψ = R⁻ᵀφ:   |δ|ψ|²| ≤ 2 |L⁻ᵀb|ᵀ(|δk| + 2 r ε |L||φ|) + 4 r ε |b|ᵀ|Rᵀ||ψ| + 2 r ε |ψ|²,   b = R⁻¹ψ
//! ```
//! with c̄_p the sum of the absolute terms of c(p, x); a substitution solves a system
//! within |ΔL| ≤ r ε |L| of the one given (Higham 2002, theorem 8.5), here done twice.
//! Beside what eq. (7) has, p parameters add p ε c̄_p to δk, their prior mean p ε |y||π₀| to the mean, and
//! ```text
//! |δ(yS y)| ≤ p ε y S y                                      the prior variance that is subtracted from
//! |δ|T y|²| ≤ 2 n p ε |Z|_F |T y|²,   Z = Y_B D/σ             orthogonal factors, δZ ≤ n p ε |Z|: δvar = 2 uᵀZᵀδZ u,
//!                                                            |u|² + |Z u|² = var
//! |δ yᵀ(S − WᵀW)₊y| ≤ p b ε (Σ_k |y_k| √S_k)²                on pivots
//! ```

use faer::{Mat, MatRef, RowRef};
use gp_core::Posterior;
use kernels::{Covariance, TorqueCovariance};
use mtgp::prior::{TaskMatrix, split};
use torque_model::{JointModel, RegressorRows, Rows};

const EPS: f64 = f64::EPSILON;

/// L⁻¹b, or L⁻ᵀb, by substitution.
fn solve(l: &Mat<f64>, rhs: &[f64], is_transposed: bool) -> Vec<f64> {
    let n = rhs.len();
    let mut solution = rhs.to_vec();
    for step in 0..n {
        let row = if is_transposed { n - 1 - step } else { step };
        let known = if is_transposed { row + 1..n } else { 0..row };
        let entry = |i: usize| {
            if is_transposed {
                l[(i, row)]
            } else {
                l[(row, i)]
            }
        };
        let sum: f64 = known.map(|i| entry(i) * solution[i]).sum();
        solution[row] = (solution[row] - sum) / l[(row, row)];
    }
    solution
}

/// |L||v| for a lower triangle.
fn absolute_product(l: &Mat<f64>, v: &[f64]) -> Vec<f64> {
    let row = |row: usize| (0..=row).map(|i| (l[(row, i)] * v[i]).abs()).sum();
    (0..v.len()).map(row).collect()
}

/// |a|ᵀ|b|.
fn absolute_dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a * b).abs()).sum()
}

/// c̄_p and |δk_p| of every basis point.
struct Entries {
    absolute: Vec<f64>,
    delta: Vec<f64>,
}

impl Entries {
    /// Of eq. (7) at points (r, 3ℓ), with d the columns that it sees of them.
    fn of_input(covariance: &TorqueCovariance, points: MatRef<'_, f64>, x: &[f64]) -> Self {
        let (points, x) = (
            covariance.continuous().embed(points),
            covariance
                .continuous()
                .embed(RowRef::from_slice(x).as_mat()),
        );
        let points = points.as_ref();
        let x: Vec<f64> = x.as_ref().row(0).iter().copied().collect();
        let (params, d) = (covariance.embedded_params(), points.ncols());
        let largest_z = |p: usize| -> f64 {
            let reach = |j: usize| points[(p, j)].abs() + x[j].abs() + 4.0;
            (0..d)
                .map(|j| (reach(j) / params.length_scales[j]).powi(2))
                .sum()
        };
        let of_point = |p: usize| -> f64 {
            let linear = |j: usize| params.linear_std[j].powi(2) * (x[j] * points[(p, j)]).abs();
            let coulomb = params.coulomb_std.iter().flatten().map(|w| w * w);
            params.bias_std.powi(2)
                + params.signal_std.powi(2)
                + (0..d).map(linear).sum::<f64>()
                + coulomb.sum::<f64>()
        };
        let absolute: Vec<f64> = (0..points.nrows()).map(of_point).collect();
        let n_terms = (2 * d + covariance.n_joints() + 2) as f64;
        let delta = (absolute.iter().enumerate()).map(|(p, absolute)| {
            (d + 2) as f64 * EPS * params.signal_std.powi(2) * largest_z(p)
                + n_terms * EPS * absolute
        });
        Self {
            delta: delta.collect(),
            absolute,
        }
    }

    /// Scaled by an entry of K^ρ for every point.
    fn scaled(self, scales: &[f64]) -> Self {
        let scaled = |values: Vec<f64>| {
            let pairs = values.iter().zip(scales);
            pairs.map(|(value, scale)| value * scale.abs()).collect()
        };
        Self {
            absolute: scaled(self.absolute),
            delta: scaled(self.delta),
        }
    }

    /// Of p parameters with prior variances S, at rows y (r, p).
    fn of_parameters(vars: &[f64], rows: MatRef<'_, f64>, y: &[f64]) -> Self {
        let of_point = |point: usize| -> f64 {
            let terms = (0..y.len()).map(|k| vars[k] * (y[k] * rows[(point, k)]).abs());
            terms.sum()
        };
        let absolute: Vec<f64> = (0..rows.nrows()).map(of_point).collect();
        let delta = absolute.iter().map(|a| (y.len() + 2) as f64 * EPS * a);
        Self {
            delta: delta.collect(),
            absolute,
        }
    }

    fn plus(self, other: &Self) -> Self {
        let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect();
        Self {
            absolute: sum(&self.absolute, &other.absolute),
            delta: sum(&self.delta, &other.delta),
        }
    }
}

/// Bounds of mean and variance, from those of c(p, x).
fn of_posterior<C: Covariance>(
    posterior: &Posterior<C>,
    row: &[f64],
    entries: &Entries,
) -> (f64, f64) {
    let basis = posterior.basis();
    let r = basis.rank();
    let rounding = 2.0 * r as f64 * EPS;
    let Entries { absolute, delta } = entries;
    let mean = (0..r).map(|p| basis.weights[p].abs() * (delta[p] + rounding * absolute[p]));

    let l = basis.factor.l().to_owned();
    let k = (posterior.covariance()).cross(basis.points.as_ref(), RowRef::from_slice(row).as_mat());
    let phi = solve(&l, k.col_as_slice(0), false);
    let residual: Vec<f64> = (absolute_product(&l, &phi).iter().zip(delta))
        .map(|(product, delta)| delta + rounding * product)
        .collect();
    let sum = absolute_dot;
    let mut var = 2.0 * sum(&solve(&l, &phi, true), &residual) + rounding * sum(&phi, &phi);
    if let Some(noise_factor) = &basis.noise_factor {
        let r_transposed = noise_factor.transpose().to_owned();
        let psi = solve(&r_transposed, &phi, false);
        let b = solve(&r_transposed, &psi, true);
        let of_phi = 2.0 * sum(&solve(&l, &b, true), &residual);
        let of_solve = 2.0 * rounding * sum(&b, &absolute_product(&r_transposed, &psi));
        let noise_var = posterior.noise_std().powi(2);
        var += noise_var * (of_phi + of_solve + rounding * sum(&psi, &psi));
    }
    (mean.sum(), var)
}

/// What the parameters' prior adds, for p of them.
fn of_parameters<C: Covariance>(
    posterior: &Posterior<C>,
    rows: &RegressorRows,
    (vars, y): (&[f64], &[f64]),
    var: f64,
) -> (f64, f64) {
    let basis = posterior.basis();
    let (p, b, d) = (y.len() as f64, basis.rank() as f64, 3 * rows.n_joints());
    let z = |point: usize, k: usize| basis.points[(point, d + k)].powi(2) * vars[k];
    let z_squared: f64 = (0..basis.rank())
        .flat_map(|point| (0..y.len()).map(move |k| (point, k)))
        .map(|(point, k)| z(point, k))
        .sum();
    let z_norm = z_squared.sqrt() / posterior.noise_std();
    let prior_var: f64 = y.iter().zip(vars).map(|(y, var)| y * y * var).sum();
    let prior_std: f64 = y
        .iter()
        .zip(vars)
        .map(|(y, var)| y.abs() * var.sqrt())
        .sum();
    let mut of_var = 2.0 * (b + p) * p * EPS * z_norm * var + p * EPS * prior_var;
    if basis.is_on_pivots() {
        of_var += p * b * EPS * prior_std.powi(2);
    }
    (p * EPS * absolute_dot(y, &rows.prior.mean), of_var)
}

/// Bounds on the differences of mean and variance between the loop and the batch at a state.
///
/// # Shapes
/// `x` (3ℓ,); `mean` and `var` those of the batch.
pub fn bounds(model: &JointModel, context: usize, x: &[f64], mean: f64, var: f64) -> (f64, f64) {
    match model {
        JointModel::Process(process) => {
            let posterior = &process.posterior;
            let points = posterior.basis().points.as_ref();
            let entries = Entries::of_input(posterior.covariance(), points, x);
            of_posterior(posterior, x, &entries)
        }
        JointModel::Tasks(process) => {
            let covariance = process.covariance();
            let (points, tasks) = split(
                process.posterior.basis().points.as_ref(),
                covariance.n_tasks(),
            );
            let k_task = covariance.task().k_task();
            let scales: Vec<f64> = tasks
                .iter()
                .map(|&other| k_task[(other, context)])
                .collect();
            let entries = Entries::of_input(covariance.input(), points, x).scaled(&scales);
            let row: Vec<f64> = x.iter().copied().chain([context as f64]).collect();
            of_posterior(&process.posterior, &row, &entries)
        }
        JointModel::RigidBody(process) => {
            informed(&process.posterior, &process.rows, model, x, var)
        }
        JointModel::RigidBodyAndProcess(process) => {
            informed(&process.posterior, &process.rows, model, x, var)
        }
        // A backward stable product, of a row with a root of order p ≤ 100 or a well-conditioned R of order p ≤ 17.
        JointModel::Linear(_) | JointModel::Shared(_) => {
            (1e3 * EPS * (1.0 + mean.abs()), 1e3 * EPS * var)
        }
    }
}

fn informed<C: Covariance>(
    posterior: &Posterior<C>,
    rows: &RegressorRows,
    model: &JointModel,
    x: &[f64],
    var: f64,
) -> (f64, f64) {
    let d = x.len();
    let row = rows.rows(0, RowRef::from_slice(x).as_mat()).unwrap();
    let row: Vec<f64> = row.row(0).iter().copied().collect();
    let y = &row[d..];
    let spread = model.spread().unwrap();
    let vars: Vec<f64> = rows
        .prior
        .std
        .iter()
        .map(|s| (spread * s).powi(2))
        .collect();
    let points = posterior.basis().points.as_ref();
    let mut entries = Entries::of_parameters(&vars, points.subcols(d, y.len()), y);
    if let Some(input) = model.input_covariance() {
        entries = entries.plus(&Entries::of_input(input, points.subcols(0, d), x));
    }
    let (mean, of_var) = of_posterior(posterior, &row, &entries);
    let (known, of_parameters) = of_parameters(posterior, rows, (&vars, y), var);
    (mean + known, of_var + of_parameters)
}
