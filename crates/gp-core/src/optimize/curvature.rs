//! What a search learns of the curvature, to be used by the next search nearby.

use faer::Mat;

use super::Objective;

/// Cosine of step and gradient change below which a pair says nothing of the curvature.
const USABLE_COSINE: f64 = 1e-6;

/// An estimate H of the inverse Hessian from steps s and gradient changes y.
///
/// ```text
/// H ← (I − ρ s yᵀ) H (I − ρ y sᵀ) + ρ s sᵀ,   ρ = 1/(yᵀs),   H₀ = (sᵀy/yᵀy) I
/// ```
/// It stays positive definite, as pairs with yᵀs ≤ 0 are left out.
/// # Source
/// Nocedal & Wright 2006, eqs. (6.17) and (6.20).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curvature {
    inverse: Option<Mat<f64>>,
}

impl Curvature {
    /// Learns from one step and the change of the gradient along it.
    fn learn(&mut self, step: &[f64], change: &[f64]) {
        let (along, steep) = (inner(step, change), inner(change, change));
        let is_usable = along > USABLE_COSINE * (inner(step, step) * steep).sqrt();
        if !is_usable || !along.is_finite() {
            return;
        }
        let n = step.len();
        let inverse = self.inverse.get_or_insert_with(|| {
            let scale = along / steep;
            Mat::from_fn(n, n, |row, col| if row == col { scale } else { 0.0 })
        });
        let hy: Vec<f64> = (0..n)
            .map(|row| (0..n).map(|col| inverse[(row, col)] * change[col]).sum())
            .collect();
        let excess = (1.0 + inner(change, &hy) / along) / along;
        for col in 0..n {
            for row in 0..n {
                inverse[(row, col)] += excess * step[row] * step[col]
                    - (hy[row] * step[col] + step[row] * hy[col]) / along;
            }
        }
    }

    /// The lower Cholesky factor of H; `None` before the first usable step.
    fn factor(&self) -> Option<Mat<f64>> {
        let inverse = self.inverse.as_ref()?;
        let n = inverse.nrows();
        let mut factor = Mat::zeros(n, n);
        for col in 0..n {
            for row in col..n {
                let sum: f64 = (0..col).map(|k| factor[(row, k)] * factor[(col, k)]).sum();
                let rest = inverse[(row, col)] - sum;
                if row == col {
                    if !(rest > 0.0 && rest.is_finite()) {
                        return None;
                    }
                    factor[(col, col)] = rest.sqrt();
                } else {
                    factor[(row, col)] = rest / factor[(col, col)];
                }
            }
        }
        Some(factor)
    }
}

/// A function in coordinates in which its curvature is about one, as far as that is known.
///
/// ```text
/// z = z₀ + P y,   P Pᵀ = H,   ∂f/∂y = Pᵀ ∂f/∂z
/// ```
/// The first step along −∂f/∂y is then the quasi-Newton step −H ∂f/∂z.
/// Where nothing is known, y is z.
pub(crate) struct Scaled<O> {
    objective: O,
    origin: Vec<f64>,
    factor: Option<Mat<f64>>,
    curvature: Curvature,
    /// z, value and ∂f/∂z.
    best: Option<(Vec<f64>, f64, Vec<f64>)>,
}

impl<O: Objective> Scaled<O> {
    /// Around z₀ = `origin`.
    pub fn new(objective: O, origin: Vec<f64>, curvature: Curvature) -> Self {
        let factor = (curvature.factor()).filter(|factor| factor.nrows() == origin.len());
        Self {
            objective,
            origin,
            factor,
            curvature,
            best: None,
        }
    }

    /// The function in its own coordinates, and what was known and learned of its curvature.
    pub fn into_parts(self) -> (O, Curvature) {
        (self.objective, self.curvature)
    }

    /// z of y.
    pub fn outer(&self, y: &[f64]) -> Vec<f64> {
        let Some(factor) = &self.factor else {
            return y.to_vec();
        };
        (self.origin.iter().enumerate())
            .map(|(row, z)| {
                z + (0..=row)
                    .map(|col| factor[(row, col)] * y[col])
                    .sum::<f64>()
            })
            .collect()
    }

    /// Steps from one best point to the next tell of the curvature.
    fn learn(&mut self, z: Vec<f64>, value: f64, gradient: &[f64]) {
        if let Some((best_z, best_value, best_gradient)) = &self.best {
            if value >= *best_value {
                return;
            }
            self.curvature.learn(
                &difference(&z, best_z),
                &difference(gradient, best_gradient),
            );
        }
        if value.is_finite() {
            self.best = Some((z, value, gradient.to_vec()));
        }
    }

    /// y of z: solves P y = z − z₀.
    pub fn inner(&self, z: &[f64]) -> Vec<f64> {
        let Some(factor) = &self.factor else {
            return z.to_vec();
        };
        let mut y = difference(z, &self.origin);
        for row in 0..y.len() {
            let sum: f64 = (0..row).map(|col| factor[(row, col)] * y[col]).sum();
            y[row] = (y[row] - sum) / factor[(row, row)];
        }
        y
    }

    /// ∂f/∂y = Pᵀ ∂f/∂z, in place.
    fn pull_back(&self, gradient: &mut [f64]) {
        let Some(factor) = &self.factor else { return };
        for col in 0..gradient.len() {
            gradient[col] = (col..gradient.len())
                .map(|row| factor[(row, col)] * gradient[row])
                .sum();
        }
    }

    /// ∂f/∂z = P⁻ᵀ ∂f/∂y.
    fn push_forward(&self, gradient: &[f64]) -> Vec<f64> {
        let mut outer = gradient.to_vec();
        if let Some(factor) = &self.factor {
            for col in (0..outer.len()).rev() {
                let sum: f64 = (col + 1..outer.len())
                    .map(|row| factor[(row, col)] * outer[row])
                    .sum();
                outer[col] = (outer[col] - sum) / factor[(col, col)];
            }
        }
        outer
    }
}

impl<O: Objective> Objective for Scaled<O> {
    fn value_and_gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> f64 {
        let z = self.outer(y);
        let value = self.objective.value_and_gradient(&z, gradient);
        self.learn(z, value, gradient);
        self.pull_back(gradient);
        value
    }

    fn projected_gradient(&self, y: &[f64], gradient: &[f64]) -> f64 {
        self.objective
            .projected_gradient(&self.outer(y), &self.push_forward(gradient))
    }

    fn released(&self, y: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        let z = self
            .objective
            .released(&self.outer(y), &self.push_forward(gradient), tolerance)?;
        Some(self.inner(&z))
    }

    fn is_spent(&self) -> bool {
        self.objective.is_spent()
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn inner(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
