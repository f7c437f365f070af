//! Bounds by smooth reparametrisation: θ = g(z) with z free.

use kernels::{ParamLayout, Transform};

use super::Objective;

/// A function of natural parameters θ inside their bounds, seen as a function of z.
///
/// ```text
/// f(z) = F(g(z)),   ∂f/∂z_j = ∂F/∂θ_j · dg_j/dz_j
/// ```
/// Near a bound dg/dz dies out, so a small ∂f/∂z does not mean convergence.
/// The gradient with respect to log θ does not die out, and it is the one that
/// counts wherever it points away from the bound.
/// A free parameter has no bound: its gradient is ∂f/∂z.
pub(crate) struct Reparametrised<F> {
    transforms: Vec<Transform>,
    natural_objective: F,
    theta: Vec<f64>,
}

impl<F: FnMut(&[f64], &mut [f64]) -> f64> Reparametrised<F> {
    /// `natural_objective` maps θ to F(θ) and writes ∂F/∂θ.
    pub fn new(layout: &ParamLayout, natural_objective: F) -> Self {
        Self {
            transforms: layout.specs().iter().map(|spec| spec.transform).collect(),
            theta: vec![0.0; layout.len()],
            natural_objective,
        }
    }

    /// Unconstrained coordinates of θ, moved inside its bounds where it is not.
    pub fn unconstrained(&self, theta: &[f64]) -> Vec<f64> {
        (self.transforms.iter().zip(theta))
            .map(|(transform, &value)| {
                let z = transform.unconstrained(value);
                if z.is_finite() {
                    z
                } else {
                    transform.unconstrained(transform.clamp_inside(value))
                }
            })
            .collect()
    }

    /// Natural values of z.
    pub fn natural(&self, z: &[f64]) -> Vec<f64> {
        (self.transforms.iter().zip(z))
            .map(|(transform, &z)| transform.natural(z))
            .collect()
    }

    /// ∂f/∂z of ∂F/∂θ at z, in place.
    pub fn pull_back(&self, z: &[f64], gradient: &mut [f64]) {
        for ((g, transform), &z) in gradient.iter_mut().zip(&self.transforms).zip(z) {
            *g *= transform.derivative(z);
        }
    }

    /// ∂F/∂log θ_j from ∂f/∂z_j; zero where z is so far out that both vanish.
    fn log_gradient(transform: Transform, z: f64, gradient: f64) -> f64 {
        let log_slope = transform.derivative(z) / transform.natural(z);
        if log_slope > f64::MIN_POSITIVE {
            gradient / log_slope
        } else {
            0.0
        }
    }

    /// The gradient that counts for convergence in one coordinate.
    fn effective_gradient(transform: Transform, z: f64, gradient: f64) -> f64 {
        let log_gradient = Self::log_gradient(transform, z, gradient);
        let falls_inwards = match transform {
            Transform::Positive | Transform::Free { .. } => false,
            Transform::Below { .. } => log_gradient > 0.0,
            Transform::SquareAbove { .. } => log_gradient < 0.0,
        };
        if falls_inwards {
            log_gradient
        } else {
            gradient
        }
    }
}

impl<F: FnMut(&[f64], &mut [f64]) -> f64> Objective for Reparametrised<F> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        for ((theta, transform), &z) in self.theta.iter_mut().zip(&self.transforms).zip(z) {
            *theta = transform.natural(z);
        }
        let mut values = self.transforms.iter().zip(&self.theta);
        if !values.all(|(transform, &theta)| transform.admits(theta)) {
            return f64::INFINITY;
        }
        let value = (self.natural_objective)(&self.theta, gradient);
        self.pull_back(z, gradient);
        let is_finite = value.is_finite() && gradient.iter().all(|g| g.is_finite());
        if is_finite { value } else { f64::INFINITY }
    }

    fn projected_gradient(&self, z: &[f64], gradient: &[f64]) -> f64 {
        (self.transforms.iter().zip(z).zip(gradient))
            .map(|((transform, &z), &g)| Self::effective_gradient(*transform, z, g).abs())
            .fold(0.0, f64::max)
    }

    fn released(&self, z: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        let mut released = z.to_vec();
        let mut is_held = false;
        for (idx, transform) in self.transforms.iter().enumerate() {
            let theta = transform.natural(z[idx]);
            let effective = Self::effective_gradient(*transform, z[idx], gradient[idx]);
            if transform.is_at_bound(theta) && effective.abs() > tolerance {
                let inside = transform.clamp_inside(theta);
                released[idx] = transform.unconstrained(inside);
                is_held |= released[idx].to_bits() != z[idx].to_bits();
            }
        }
        is_held.then_some(released)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout() -> ParamLayout {
        ParamLayout::new()
            .with_scalar("free", Transform::Positive)
            .with_scalar("below", Transform::Below { ceiling: 100.0 })
            .with_scalar("above", Transform::SquareAbove { floor: 1e-4 })
    }

    #[test]
    fn natural_values_survive_the_round_trip() {
        let objective = Reparametrised::new(&layout(), |_: &[f64], _: &mut [f64]| 0.0);
        let theta = [3.5e-7, 99.0, 0.0101];
        let back = objective.natural(&objective.unconstrained(&theta));
        for (value, expected) in back.iter().zip(theta) {
            // θ² − f loses (θ²/(θ² − f)) ≈ 50 of the precision of θ, once more in exp(ln).
            assert!(
                (value / expected - 1.0).abs() <= 200.0 * f64::EPSILON,
                "{value} {expected}"
            );
        }
    }

    #[test]
    fn start_outside_its_bounds_is_moved_inside() {
        let objective = Reparametrised::new(&layout(), |_: &[f64], _: &mut [f64]| 0.0);
        let inside = objective.natural(&objective.unconstrained(&[1.0, 250.0, 1e-3]));
        assert!((inside[1] - 90.0).abs() < 1e-12);
        assert!((inside[2] * inside[2] - 2e-4).abs() < 1e-18);
    }

    #[test]
    fn gradient_is_that_of_central_differences() {
        // F = Σ θ_j³, with ∂F/∂θ_j = 3θ_j².
        let mut objective = Reparametrised::new(&layout(), |theta: &[f64], g: &mut [f64]| {
            for (g, t) in g.iter_mut().zip(theta) {
                *g = 3.0 * t * t;
            }
            theta.iter().map(|t| t.powi(3)).sum()
        });
        let z = [0.3, 1.2, -6.0];
        let mut gradient = [0.0; 3];
        objective.value_and_gradient(&z, &mut gradient);
        let step = 1e-5;
        for j in 0..3 {
            let (mut high, mut low, mut unused) = (z, z, [0.0; 3]);
            high[j] += step;
            low[j] -= step;
            let rise = objective.value_and_gradient(&high, &mut unused);
            let fall = objective.value_and_gradient(&low, &mut unused);
            let difference = (rise - fall) / (2.0 * step);
            // Rounding ε F/h with F ≈ 4.6e5, truncation h² f‴/6 with |f‴| ≤ 27 F.
            let tolerance = 4.6e5 * (4.0 * f64::EPSILON / step + 27.0 * step * step / 6.0);
            assert!(
                (gradient[j] - difference).abs() <= tolerance,
                "{j}: {gradient:?}"
            );
        }
    }

    #[test]
    fn free_parameter_may_be_negative_or_zero() {
        // F = (θ + 3)², θ = 2z.
        let layout = ParamLayout::new().with_scalar("f", Transform::Free { scale: 2.0 });
        let mut objective = Reparametrised::new(&layout, |theta: &[f64], g: &mut [f64]| {
            g[0] = 2.0 * (theta[0] + 3.0);
            (theta[0] + 3.0).powi(2)
        });
        let z = objective.unconstrained(&[-4.0]);
        let mut gradient = [0.0];
        assert!((objective.value_and_gradient(&z, &mut gradient) - 1.0).abs() < 1e-15);
        // ∂f/∂z = 2 · 2(θ + 3).
        assert!((objective.projected_gradient(&z, &gradient) - 4.0).abs() < 1e-15);
        assert!((objective.value_and_gradient(&[0.0], &mut gradient) - 9.0).abs() < 1e-15);
        assert!((objective.projected_gradient(&[0.0], &gradient) - 12.0).abs() < 1e-15);
        assert!(objective.released(&[0.0], &gradient, 1e-5).is_none());
    }

    #[test]
    fn bound_that_points_inwards_is_not_convergence() {
        // F = (θ² − 1)² with θ held at its floor: f is flat in z but falls in θ.
        let layout = ParamLayout::new().with_scalar("s", Transform::SquareAbove { floor: 1e-4 });
        let mut objective = Reparametrised::new(&layout, |theta: &[f64], g: &mut [f64]| {
            let excess = theta[0] * theta[0] - 1.0;
            g[0] = 4.0 * theta[0] * excess;
            excess * excess
        });
        let z = [-40.0];
        let mut gradient = [0.0];
        objective.value_and_gradient(&z, &mut gradient);
        assert!(gradient[0].abs() < 1e-16);
        // ∂F/∂log θ = θ ∂F/∂θ = 4θ²(θ² − 1) ≈ −4e-4.
        assert!(objective.projected_gradient(&z, &gradient) > 3.9e-4);
        assert!(objective.released(&z, &gradient, 1e-5).is_some());
    }
}
