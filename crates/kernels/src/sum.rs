//! The sum of two covariances, which is a covariance.

use faer::{MatMut, MatRef};

use crate::covariance::Covariance;
use crate::params::ParamLayout;

/// The covariance of the sum of two independent functions.
///
/// ```text
/// c(x, x′) = c₁(x, x′) + c₂(x, x′)
/// ```
/// θ is θ₁ followed by θ₂. Longer sums nest.
/// # Source
/// Eq. (7); Rasmussen & Williams 2006, sec. 4.2.4.
#[derive(Debug, Clone, PartialEq)]
pub struct Sum<A, B> {
    first: A,
    second: B,
}

impl<A: Covariance, B: Covariance> Sum<A, B> {
    /// The sum of `first` and `second`.
    pub fn new(first: A, second: B) -> Self {
        Self { first, second }
    }

    /// The first term.
    pub fn first(&self) -> &A {
        &self.first
    }

    /// The second term.
    pub fn second(&self) -> &B {
        &self.second
    }
}

impl<A: Covariance, B: Covariance> Covariance for Sum<A, B> {
    fn layout(&self) -> ParamLayout {
        self.first.layout().followed_by(self.second.layout())
    }

    fn params(&self) -> Vec<f64> {
        let mut theta = self.first.params();
        theta.extend(self.second.params());
        theta
    }

    fn set_params(&mut self, theta: &[f64]) {
        let (first, second) = theta.split_at(self.first.n_params());
        self.first.set_params(first);
        self.second.set_params(second);
    }

    fn add_gram(&self, x: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        self.first.add_gram(x, out.as_mut());
        self.second.add_gram(x, out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        self.first.add_cross(x1, x2, out.as_mut());
        self.second.add_cross(x1, x2, out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        self.first.add_diag(x, out);
        self.second.add_diag(x, out);
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        let (first, second) = gradient.split_at_mut(self.first.n_params());
        self.first.gram_adjoint(x, adjoint, first);
        self.second.gram_adjoint(x, adjoint, second);
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        let (first, second) = gradient.split_at_mut(self.first.n_params());
        self.first.cross_adjoint(x1, x2, adjoint, first);
        self.second.cross_adjoint(x1, x2, adjoint, second);
    }

    fn n_params(&self) -> usize {
        self.first.n_params() + self.second.n_params()
    }
}
