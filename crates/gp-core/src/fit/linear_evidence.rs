//! The variances of a linear model's noise and weights that have the highest evidence.

use faer::{Mat, MatRef};

use super::stacked_system::r_with_targets;

/// A column whose spread is below this part of its size is taken for constant.
const CONSTANT_COLUMN: f64 = 1e-12;

/// Least σ, as a part of the targets' standard deviation, or of their mean if they are all equal.
const NOISE_PART: f64 = 1e-6;

/// Powers of ten between which n (τ/σ)² is sought, and steps per power before the best is refined.
const EXPONENTS: [i32; 2] = [-8, 16];
const STEPS: i32 = 4;

/// Halvings of the step around the best: to 10⁻¹² of it.
const HALVINGS: usize = 40;

/// Features, the constant last, as deviations from their means in units of their standard deviations.
pub(super) struct Standardised {
    means: Vec<f64>,
    /// A constant feature counts in units of its size, or of one.
    units: Vec<f64>,
}

/// Variances of the highest evidence.
pub(super) struct Evident {
    /// σ².
    pub noise_var: f64,
    /// σ/τ.
    pub noise_to_weight: f64,
}

impl Standardised {
    /// Of features (n, p), the last of which is the constant.
    pub fn of(features: &Mat<f64>) -> Self {
        let (n, k) = (features.nrows() as f64, features.ncols() - 1);
        let columns = || (0..k).map(|col| features.col_as_slice(col));
        let means = columns().map(|values| values.iter().sum::<f64>() / n);
        let means: Vec<f64> = means.collect();
        let units = columns().zip(&means);
        Self {
            units: units.map(|(values, mean)| unit_of(values, *mean)).collect(),
            means,
        }
    }

    /// The rows, (n, p − 1), without the constant.
    pub fn of_rows(&self, features: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(features.nrows(), self.means.len(), |row, col| {
            (features[(row, col)] - self.means[col]) / self.units[col]
        })
    }

    /// What the prior says of the weights β of the features as they are, (p, p).
    ///
    /// ```text
    /// w_j = s_j β_j ~ N(0, τ²):  (σ/τ) s_j in column j;   nothing of the constant
    /// ```
    pub fn prior_rows(&self, noise_to_weight: f64) -> Mat<f64> {
        let p = self.units.len() + 1;
        Mat::from_fn(p, p, |row, col| match self.units.get(row) {
            Some(unit) if row == col => noise_to_weight * unit,
            _ => 0.0,
        })
    }
}

/// Standard deviation of values, or their size if they are all equal, or one.
fn unit_of(values: &[f64], mean: f64) -> f64 {
    let size = values
        .iter()
        .fold(0.0, |most: f64, value| most.max(value.abs()));
    let squares = values.iter().map(|value| ((value - mean) / size).powi(2));
    let spread = size * (squares.sum::<f64>() / values.len() as f64).sqrt();
    if spread > CONSTANT_COLUMN * size {
        spread
    } else if size > 0.0 {
        size
    } else {
        1.0
    }
}

/// The variances for standardised features z, (n, k), and targets.
///
/// ```text
/// t − t̄ ~ N(0, σ²I + τ²ZZᵀ) in the n − 1 dimensions that a constant leaves;   Z = U S Vᵀ,  c = Uᵀ(t − t̄)
/// σ² = (|t − t̄|² − Σ_i c_i² ρs_i²/(1 + ρs_i²))/(n − 1),   ρ = τ²/σ²
/// −2 log p = (n − 1) log σ² + Σ_i log(1 + ρs_i²) + …
/// ```
/// at its least over ρ. Where each row counts w, n is their sum, and s_i and c_i are those of √w Z and √w(t − t̄).
pub(super) fn most_evident(z: &Mat<f64>, targets: &[f64], weight: f64) -> Evident {
    let (n, k) = (z.nrows() as f64, z.ncols());
    let mean = targets.iter().sum::<f64>() / n;
    let unit = unit_of(targets, mean);
    let root = weight.sqrt();
    let centred: Vec<f64> = targets.iter().map(|t| root * ((t - mean) / unit)).collect();
    let z = faer::Scale(root) * z;
    let r = r_with_targets(&z, &centred, Mat::zeros(k, k).as_ref()); // (k + 1, k + 1)
    let evidence = Evidence::new(r.as_ref(), weight * n - 1.0);
    let rho = evidence.best_rho(weight * n);
    let var = evidence.noise_var(rho).max(NOISE_PART * NOISE_PART);
    Evident {
        noise_var: var * unit * unit,
        noise_to_weight: 1.0 / rho.sqrt(),
    }
}

/// −2 log p as a function of ρ.
struct Evidence {
    /// s_i².
    squares: Vec<f64>,
    /// c_i².
    along: Vec<f64>,
    /// |t − t̄|² outside the span of Z.
    outside: f64,
    n_free: f64,
}

impl Evidence {
    fn new(r: MatRef<'_, f64>, n_free: f64) -> Self {
        let k = r.ncols() - 1;
        let upper = Mat::from_fn(
            k,
            k,
            |row, col| if row <= col { r[(row, col)] } else { 0.0 },
        );
        let outside = r[(k, k)].powi(2);
        // A matrix of finite numbers has a decomposition; without one nothing is along the features.
        let Ok(svd) = upper.svd() else {
            return Self {
                squares: Vec::new(),
                along: Vec::new(),
                outside: outside + (0..k).map(|row| r[(row, k)].powi(2)).sum::<f64>(),
                n_free,
            };
        };
        let along = |i: usize| {
            (0..k)
                .map(|row| svd.U()[(row, i)] * r[(row, k)])
                .sum::<f64>()
        };
        Self {
            squares: svd.S().column_vector().iter().map(|s| s * s).collect(),
            along: (0..k).map(|i| along(i).powi(2)).collect(),
            outside,
            n_free,
        }
    }

    /// σ² of the highest evidence given ρ.
    fn noise_var(&self, rho: f64) -> f64 {
        let along = self.along.iter().zip(&self.squares);
        let left: f64 = along
            .map(|(along, square)| along / (1.0 + rho * square))
            .sum();
        (self.outside + left) / self.n_free
    }

    /// −2 log p given ρ, but for a constant.
    fn value(&self, rho: f64) -> f64 {
        let var = self.noise_var(rho).max(NOISE_PART * NOISE_PART);
        let penalty: f64 = self
            .squares
            .iter()
            .map(|square| (rho * square).ln_1p())
            .sum();
        self.n_free * var.ln() + self.n_free * self.noise_var(rho) / var + penalty
    }

    fn best_rho(&self, n: f64) -> f64 {
        let rho_at = |step: f64| 10_f64.powf(step / f64::from(STEPS)) / n;
        let value_at = |step: f64| self.value(rho_at(step));
        let steps = (STEPS * EXPONENTS[0]..=STEPS * EXPONENTS[1]).map(f64::from);
        let lower = |best: (f64, f64), next: (f64, f64)| if next.1 < best.1 { next } else { best };
        let all = steps.map(|step| (step, value_at(step)));
        let (mut step, mut value) = all.reduce(lower).unwrap_or((0.0, f64::INFINITY));
        let mut width = 0.5;
        for _ in 0..HALVINGS {
            for next in [step - width, step + width] {
                (step, value) = lower((step, value), (next, value_at(next)));
            }
            width *= 0.5;
        }
        rho_at(step)
    }
}
