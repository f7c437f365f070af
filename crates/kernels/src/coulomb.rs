//! The Coulomb friction term of eq. (6): one step per joint, by the sign of its velocity.

use faer::{Mat, MatMut, MatRef};
use linalg::{column_mut, for_each_column};

use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::features;
use crate::params::{ParamLayout, Transform};
use crate::positive::require_positive;

/// Sign of a number, with sgn(0) = 0 for either zero.
///
/// `f64::signum` gives ±1 at ±0, which would give friction to a joint at rest.
#[inline]
pub fn sgn(value: f64) -> f64 {
    if value > 0.0 {
        1.0
    } else if value < 0.0 {
        -1.0
    } else {
        // Zero stays zero, NaN stays NaN.
        value + 0.0
    }
}

/// Covariance of symmetric Coulomb friction with an unknown level per joint.
///
/// ```text
/// c(x, x′) = Σ_j w_j² sgn(q̇_j) sgn(q̇′_j)      sgn(0) = 0
/// ```
/// θ = (`coulomb_std[0]`, …), one per joint, in target units.
/// # Shapes
/// `x` has 3ℓ columns (q, q̇, q̈); q̇ is the second third.
/// # Source
/// Eq. (6).
#[derive(Debug, Clone, PartialEq)]
pub struct Coulomb {
    coulomb_std: Vec<f64>,
}

impl Coulomb {
    /// The Coulomb term with one standard deviation w_j per joint.
    ///
    /// # Errors
    /// [`KernelError::NotPositive`] unless all are finite and above zero.
    pub fn new(coulomb_std: Vec<f64>) -> Result<Self, KernelError> {
        require_positive("coulomb_std", &coulomb_std)?;
        Ok(Self { coulomb_std })
    }

    /// Standard deviations w_j of the friction levels, one per joint.
    pub fn coulomb_std(&self) -> &[f64] {
        &self.coulomb_std
    }

    /// The features sgn(q̇), (n, ℓ).
    fn signs(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let n_joints = self.coulomb_std.len();
        assert_eq!(
            x.ncols(),
            3 * n_joints,
            "x holds (q, qd, qdd) of each joint"
        );
        let mut signs = Mat::zeros(x.nrows(), n_joints);
        write_signs(x, n_joints, signs.as_mut());
        signs
    }
}

/// Fills `out` (n, ℓ) with sgn(q̇); x is (q, q̇, q̈).
pub(crate) fn write_signs(x: MatRef<'_, f64>, n_joints: usize, mut out: MatMut<'_, f64>) {
    for_each_column(x.subcols(n_joints, n_joints), |joint, velocities| {
        let signs = column_mut(&mut out, joint);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for (sign, velocity) in signs.iter_mut().zip(velocities) {
                    *sign = sgn(*velocity);
                }
            },
        );
    });
}

impl Covariance for Coulomb {
    fn layout(&self) -> ParamLayout {
        ParamLayout::new().with_vector("coulomb_std", self.coulomb_std.len(), Transform::Positive)
    }

    fn params(&self) -> Vec<f64> {
        self.coulomb_std.clone()
    }

    fn set_params(&mut self, theta: &[f64]) {
        self.coulomb_std.copy_from_slice(theta);
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        features::add_gram(self.signs(x).as_ref(), &self.coulomb_std, out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        let (signs1, signs2) = (self.signs(x1), self.signs(x2));
        features::add_cross(signs1.as_ref(), signs2.as_ref(), &self.coulomb_std, out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        features::add_diag(self.signs(x).as_ref(), &self.coulomb_std, out);
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        features::add_adjoint(self.signs(x).as_ref(), &self.coulomb_std, adjoint, gradient);
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        let (signs1, signs2) = (self.signs(x1), self.signs(x2));
        features::add_cross_adjoint(
            signs1.as_ref(),
            signs2.as_ref(),
            &self.coulomb_std,
            adjoint,
            gradient,
        );
    }
}
