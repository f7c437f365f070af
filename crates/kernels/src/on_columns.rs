//! A covariance that sees some of the columns of its inputs only.

use std::ops::Range;

use faer::{MatMut, MatRef};

use crate::covariance::Covariance;
use crate::params::ParamLayout;

/// A covariance of a range of the columns.
///
/// ```text
/// c((…, a, …), (…, a′, …)) = c₀(a, a′)
/// ```
/// With [`crate::Sum`] it adds functions of different inputs: torques of x and of the regressor Y(x),
/// in rows (x, Y(x)).
#[derive(Debug, Clone, PartialEq)]
pub struct OnColumns<C> {
    inner: C,
    columns: Range<usize>,
}

impl<C: Covariance> OnColumns<C> {
    /// `inner` of the columns given.
    pub fn new(inner: C, columns: Range<usize>) -> Self {
        Self { inner, columns }
    }

    /// c₀.
    pub fn inner(&self) -> &C {
        &self.inner
    }

    /// The columns that it sees.
    pub fn columns(&self) -> Range<usize> {
        self.columns.clone()
    }

    fn of<'a>(&self, x: MatRef<'a, f64>) -> MatRef<'a, f64> {
        x.subcols(self.columns.start, self.columns.len())
    }
}

impl<C: Covariance> Covariance for OnColumns<C> {
    fn layout(&self) -> ParamLayout {
        self.inner.layout()
    }

    fn params(&self) -> Vec<f64> {
        self.inner.params()
    }

    fn set_params(&mut self, theta: &[f64]) {
        self.inner.set_params(theta);
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        self.inner.add_gram(self.of(x), out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        self.inner.add_cross(self.of(x1), self.of(x2), out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        self.inner.add_diag(self.of(x), out);
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        self.inner.gram_adjoint(self.of(x), adjoint, gradient);
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        (self.inner).cross_adjoint(self.of(x1), self.of(x2), adjoint, gradient);
    }

    fn n_params(&self) -> usize {
        self.inner.n_params()
    }
}
