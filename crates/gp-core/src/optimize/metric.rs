//! Coordinates in which a given metric is the identity.

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{ColMut, Mat, MatRef, Par, Side};

use super::Objective;

/// A symmetric positive definite matrix G by which steps are measured.
///
/// ```text
/// |dz|² = dzᵀ G dz,   G = L Lᵀ
/// ```
pub(crate) struct Metric {
    l: Mat<f64>,
}

impl Metric {
    /// The metric of a matrix whose lower triangle is read; `None` unless it is positive definite.
    pub fn new(g: MatRef<'_, f64>) -> Option<Self> {
        let llt = g.llt(Side::Lower).ok()?;
        Some(Self {
            l: llt.L().to_owned(),
        })
    }

    /// L⁻ᵀ v
    pub fn step(&self, v: &[f64]) -> Vec<f64> {
        let mut out = v.to_vec();
        let column = ColMut::from_slice_mut(&mut out).as_mat_mut();
        solve_upper_triangular_in_place(self.l.transpose(), column, Par::Seq);
        out
    }

    /// L⁻¹ v, in place.
    pub fn pull_back(&self, v: &mut [f64]) {
        let column = ColMut::from_slice_mut(v).as_mat_mut();
        solve_lower_triangular_in_place(self.l.as_ref(), column, Par::Seq);
    }

    /// L v
    fn push_forward(&self, v: &[f64]) -> Vec<f64> {
        (0..v.len())
            .map(|row| (0..=row).map(|col| self.l[(row, col)] * v[col]).sum())
            .collect()
    }

    /// Lᵀ v
    fn coordinates(&self, v: &[f64]) -> Vec<f64> {
        (0..v.len())
            .map(|col| (col..v.len()).map(|row| self.l[(row, col)] * v[row]).sum())
            .collect()
    }
}

/// A function in coordinates around a point, in which a metric is the identity.
///
/// ```text
/// z = z₀ + L⁻ᵀ y,   ∂f/∂y = L⁻¹ ∂f/∂z
/// ```
/// The first step along −∂f/∂y is then the step −G⁻¹ ∂f/∂z: with the Fisher information
/// for G, that of Fisher's scoring.
/// Without a metric, y is z.
pub(crate) struct Scaled<O> {
    objective: O,
    origin: Vec<f64>,
    metric: Option<Metric>,
}

impl<O: Objective> Scaled<O> {
    /// Around z₀ = `origin`.
    pub fn new(objective: O, origin: Vec<f64>, metric: Option<Metric>) -> Self {
        Self {
            objective,
            origin,
            metric,
        }
    }

    /// The function in its own coordinates.
    pub fn into_inner(self) -> O {
        self.objective
    }

    /// y of z₀.
    pub fn start(&self) -> Vec<f64> {
        match self.metric {
            Some(_) => vec![0.0; self.origin.len()],
            None => self.origin.clone(),
        }
    }

    /// z of y.
    pub fn outer(&self, y: &[f64]) -> Vec<f64> {
        let Some(metric) = &self.metric else {
            return y.to_vec();
        };
        let step = metric.step(y);
        (self.origin.iter().zip(step)).map(|(z, s)| z + s).collect()
    }

    /// ∂f/∂z of ∂f/∂y.
    pub fn outer_gradient(&self, gradient: &[f64]) -> Vec<f64> {
        match &self.metric {
            Some(metric) => metric.push_forward(gradient),
            None => gradient.to_vec(),
        }
    }

    /// y of z.
    fn inner(&self, z: &[f64]) -> Vec<f64> {
        let Some(metric) = &self.metric else {
            return z.to_vec();
        };
        let step: Vec<f64> = z.iter().zip(&self.origin).map(|(z, o)| z - o).collect();
        metric.coordinates(&step)
    }
}

impl<O: Objective> Objective for Scaled<O> {
    fn value_and_gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> f64 {
        let z = self.outer(y);
        let value = self.objective.value_and_gradient(&z, gradient);
        if let (Some(metric), true) = (&self.metric, value.is_finite()) {
            metric.pull_back(gradient);
        }
        value
    }

    fn projected_gradient(&self, y: &[f64], gradient: &[f64]) -> f64 {
        let (z, gradient) = (self.outer(y), self.outer_gradient(gradient));
        self.objective.projected_gradient(&z, &gradient)
    }

    fn released(&self, y: &[f64], gradient: &[f64], tolerance: f64) -> Option<Vec<f64>> {
        let (z, gradient) = (self.outer(y), self.outer_gradient(gradient));
        let z = self.objective.released(&z, &gradient, tolerance)?;
        Some(self.inner(&z))
    }

    fn is_spent(&self) -> bool {
        self.objective.is_spent()
    }
}

#[cfg(test)]
mod tests {
    use super::super::{MinimizeOptions, StopReason, minimize};
    use super::*;

    /// ½ (z − c)ᵀ A (z − c) with curvatures that span ten orders of magnitude.
    struct Valley {
        hessian: Mat<f64>,
    }

    const CENTRE: [f64; 3] = [1.0, -2.0, 0.5];

    impl Valley {
        fn new() -> Self {
            // A = R D Rᵀ with a lower triangular R of unit diagonal.
            let r = Mat::from_fn(3, 3, |a, b| match a.cmp(&b) {
                std::cmp::Ordering::Less => 0.0,
                std::cmp::Ordering::Equal => 1.0,
                std::cmp::Ordering::Greater => 0.5,
            });
            let d = Mat::from_fn(3, 3, |a, b| if a == b { [1e6, 1.0, 1e-4][a] } else { 0.0 });
            Self {
                hessian: &r * &d * r.transpose(),
            }
        }
    }

    impl Objective for Valley {
        fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
            let off: Vec<f64> = z.iter().zip(CENTRE).map(|(z, c)| z - c).collect();
            let mut value = 0.0;
            for row in 0..3 {
                gradient[row] = (0..3).map(|col| self.hessian[(row, col)] * off[col]).sum();
                value += 0.5 * off[row] * gradient[row];
            }
            value
        }
    }

    fn scaled() -> Scaled<Valley> {
        let valley = Valley::new();
        let metric = Metric::new(valley.hessian.as_ref());
        Scaled::new(valley, vec![0.0; 3], metric)
    }

    #[test]
    fn in_the_metric_of_its_hessian_a_quadratic_falls_in_one_step() {
        let mut scaled = scaled();
        let mut gradient = vec![0.0; 3];
        scaled.value_and_gradient(&[0.0; 3], &mut gradient);
        let step: Vec<f64> = gradient.iter().map(|g| -g).collect();
        for (z, c) in scaled.outer(&step).iter().zip(CENTRE) {
            // The condition number 1e10 of A takes ten of sixteen digits.
            assert!((z - c).abs() < 1e-5, "{z} {c}");
        }
    }

    #[test]
    fn gradient_is_that_of_the_function_in_the_new_coordinates() {
        let mut scaled = scaled();
        let y = [0.3, -0.7, 0.2];
        let mut gradient = vec![0.0; 3];
        scaled.value_and_gradient(&y, &mut gradient);
        let mut unused = vec![0.0; 3];
        for idx in 0..3 {
            let mut at = |shift: f64| {
                let mut y = y;
                y[idx] += shift;
                scaled.value_and_gradient(&y, &mut unused)
            };
            // A quadratic: central differences are exact but for rounding ε f/h.
            let slope = (at(1e-3) - at(-1e-3)) / 2e-3;
            assert!((slope - gradient[idx]).abs() < 1e-4 * gradient[idx].abs().max(1.0));
        }
        let z = scaled.outer(&y);
        for (there, back) in y.iter().zip(scaled.inner(&z)) {
            assert!((there - back).abs() < 1e-9);
        }
        let mut of_z = vec![0.0; 3];
        Valley::new().value_and_gradient(&z, &mut of_z);
        for (a, b) in of_z.iter().zip(scaled.outer_gradient(&gradient)) {
            assert!((a - b).abs() <= 1e-9 * a.abs().max(1.0), "{a} {b}");
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_no_metric() {
        let g = Mat::from_fn(2, 2, |a, b| if a == b { 1.0 } else { 2.0 });
        assert!(Metric::new(g.as_ref()).is_none());
        assert!(Metric::new(Mat::full(2, 2, f64::NAN).as_ref()).is_none());
    }

    #[test]
    fn without_a_metric_the_function_is_as_it_was() {
        let mut plain = Scaled::new(Valley::new(), vec![3.0; 3], None);
        assert_eq!(plain.start(), [3.0; 3]);
        let options = MinimizeOptions {
            gradient_tolerance: 1e-6,
            value_tolerance: 0.0,
            max_evaluations: 400,
            max_recoveries: 10,
        };
        let start = plain.start();
        let minimum = minimize(&mut plain, &start, &options);
        assert!(minimum.value < 1e-6, "{minimum:?}");
        assert_ne!(minimum.stop, StopReason::StartUndefined);
    }
}
