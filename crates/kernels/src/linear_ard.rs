//! The linear term Σ_j u_j² x_j x′_j of eq. (5), one weight per covariate.

use faer::{MatMut, MatRef};

use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::features;
use crate::params::{LINEAR_STD_CEILING, ParamLayout, Transform};
use crate::positive::require_positive;

/// Covariance of a linear function whose weights have their own prior variance.
///
/// ```text
/// c(x, x′) = Σ_j u_j² x_j x′_j
/// ```
/// θ = (`linear_std[0]`, …), in target units per unit of the covariate.
/// The covariates enter as they are, not centred.
/// # Source
/// Eq. (5), second term; Rasmussen & Williams 2006, sec. 4.2.2.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearArd {
    linear_std: Vec<f64>,
}

impl LinearArd {
    /// The linear term with one standard deviation u_j per covariate.
    ///
    /// # Errors
    /// [`KernelError::NotPositive`] unless all are finite and above zero.
    pub fn new(linear_std: Vec<f64>) -> Result<Self, KernelError> {
        require_positive("linear_std", &linear_std)?;
        Ok(Self { linear_std })
    }

    /// Standard deviations u_j of the weights, one per covariate.
    pub fn linear_std(&self) -> &[f64] {
        &self.linear_std
    }
}

impl Covariance for LinearArd {
    fn layout(&self) -> ParamLayout {
        let bound = Transform::Below {
            ceiling: LINEAR_STD_CEILING,
        };
        ParamLayout::new().with_vector("linear_std", self.linear_std.len(), bound)
    }

    fn params(&self) -> Vec<f64> {
        self.linear_std.clone()
    }

    fn set_params(&mut self, theta: &[f64]) {
        self.linear_std.copy_from_slice(theta);
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        assert_eq!(x.ncols(), self.linear_std.len());
        features::add_gram(x, &self.linear_std, out);
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        assert_eq!(x1.ncols(), self.linear_std.len());
        assert_eq!(x2.ncols(), self.linear_std.len());
        features::add_cross(x1, x2, &self.linear_std, out);
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        assert_eq!(x.ncols(), self.linear_std.len());
        features::add_diag(x, &self.linear_std, out);
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        assert_eq!(x.ncols(), self.linear_std.len());
        features::add_adjoint(x, &self.linear_std, adjoint, gradient);
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        assert_eq!(x1.ncols(), self.linear_std.len());
        assert_eq!(x2.ncols(), self.linear_std.len());
        features::add_cross_adjoint(x1, x2, &self.linear_std, adjoint, gradient);
    }
}
