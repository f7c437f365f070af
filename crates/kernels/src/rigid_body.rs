//! The covariance of torques that are linear in parameters with a Gaussian prior, τ = Y(x)π.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};

use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::features;
use crate::params::{ParamLayout, Transform};
use crate::positive::require_positive;

/// Covariance of a torque y·π with unknown parameters π of known prior covariance, up to a scale.
///
/// ```text
/// τ = y·π,   π ~ N(π₀, s² Σ)      ⇒      c(y, y′) = s² yᵀ Σ y′,   Σ = RRᵀ
/// ```
/// An input is a row y of the regressor, Y_j(x): the covariance does not know how x made it.
/// So it couples joints as it stands, since rows of several joints share π:
///
/// ```text
/// cov(τ_i(x), τ_j(x′)) = s² Y_i(x) Σ Y_j(x′)ᵀ
/// ```
/// and it separates loads when every load has columns of its own for what depends on it.
/// The mean Yπ₀ is the caller's to subtract.
/// θ = (`spread`), s without unit.
/// # Shapes
/// Inputs (n, p), one regressor row each; Σ (p, p) in the units of ππᵀ.
/// # Source
/// Sec. 3.2, the prior from the linear-in-parameters model, eqs. (10)–(12); Rasmussen & Williams 2006,
/// sec. 2.7.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBody {
    /// R, (p, k): its columns that are not all zero.
    root: Mat<f64>,
    spread: f64,
}

impl RigidBody {
    /// The covariance with Σ = RRᵀ and s = `spread`.
    ///
    /// # Shapes
    /// `root` R, (p, k).
    /// # Errors
    /// [`KernelError::NotFinite`] for an entry of R that is NaN or infinite;
    /// [`KernelError::NotPositive`] unless `spread` is finite and above zero.
    pub fn new(root: MatRef<'_, f64>, spread: f64) -> Result<Self, KernelError> {
        require_positive("spread", &[spread])?;
        for col in 0..root.ncols() {
            for row in 0..root.nrows() {
                let value = root[(row, col)];
                if !value.is_finite() {
                    let name = format!("parameter_root[{row},{col}]");
                    return Err(KernelError::NotFinite { name, value });
                }
            }
        }
        let is_used = |col: &usize| root.col(*col).iter().any(|value| *value != 0.0);
        let used: Vec<usize> = (0..root.ncols()).filter(is_used).collect();
        let root = Mat::from_fn(root.nrows(), used.len(), |row, col| root[(row, used[col])]);
        Ok(Self { root, spread })
    }

    /// Parameters that are independent, with one standard deviation each; zero for one that is known.
    ///
    /// # Errors
    /// As for [`RigidBody::new`]; the sign of a standard deviation does not matter.
    pub fn independent(parameter_std: &[f64], spread: f64) -> Result<Self, KernelError> {
        let p = parameter_std.len();
        let root = Mat::from_fn(
            p,
            p,
            |row, col| {
                if row == col { parameter_std[row] } else { 0.0 }
            },
        );
        Self::new(root.as_ref(), spread)
    }

    /// s.
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// Number of parameters p.
    pub fn n_parameters(&self) -> usize {
        self.root.nrows()
    }

    /// Prior covariance s²Σ of the parameters, (p, p).
    pub fn parameter_covariance(&self) -> Mat<f64> {
        let scale = self.spread * self.spread;
        product(self.root.as_ref(), self.root.transpose(), scale)
    }

    /// The features YR, (n, k): independent standard normal weights of theirs make the prior at s = 1.
    fn features(&self, y: MatRef<'_, f64>) -> Mat<f64> {
        assert_eq!(y.ncols(), self.n_parameters(), "a row is one of Y");
        product(y, self.root.as_ref(), 1.0)
    }

    /// s for every feature.
    fn weights(&self) -> Vec<f64> {
        vec![self.spread; self.root.ncols()]
    }
}

/// scale · a b, on one thread.
fn product(a: MatRef<'_, f64>, b: MatRef<'_, f64>, scale: f64) -> Mat<f64> {
    let mut out = Mat::zeros(a.nrows(), b.ncols());
    matmul(out.as_mut(), Accum::Replace, a, b, scale, Par::Seq);
    out
}

impl Covariance for RigidBody {
    fn layout(&self) -> ParamLayout {
        ParamLayout::new().with_scalar("spread", Transform::Positive)
    }

    fn params(&self) -> Vec<f64> {
        vec![self.spread]
    }

    fn set_params(&mut self, theta: &[f64]) {
        assert_eq!(theta.len(), 1, "the prior has one hyperparameter");
        self.spread = theta[0];
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        features::add_gram(self.features(x).as_ref(), &self.weights(), out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        let (features1, features2) = (self.features(x1), self.features(x2));
        features::add_cross(features1.as_ref(), features2.as_ref(), &self.weights(), out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        features::add_diag(self.features(x).as_ref(), &self.weights(), out);
    }

    /// ∂/∂s is the sum of the slopes of its features' weights, which are all s.
    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        assert_eq!(gradient.len(), 1);
        let mut of_weights = vec![0.0; self.root.ncols()];
        let features = self.features(x);
        features::add_adjoint(features.as_ref(), &self.weights(), adjoint, &mut of_weights);
        gradient[0] += of_weights.iter().sum::<f64>();
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        assert_eq!(gradient.len(), 1);
        let (features1, features2) = (self.features(x1), self.features(x2));
        let mut of_weights = vec![0.0; self.root.ncols()];
        features::add_cross_adjoint(
            features1.as_ref(),
            features2.as_ref(),
            &self.weights(),
            adjoint,
            &mut of_weights,
        );
        gradient[0] += of_weights.iter().sum::<f64>();
    }

    fn n_params(&self) -> usize {
        1
    }
}
