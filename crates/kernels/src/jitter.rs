//! The noise term σ²δ of eq. (5).

use faer::{MatMut, MatRef};

use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::params::{NOISE_VAR_FLOOR, ParamLayout, Transform};
use crate::positive::require_positive;

/// Independent noise on every observation.
///
/// ```text
/// c(x_a, x_b) = σ² if a and b are the same observation, else 0
/// ```
/// θ = (`noise_std`), in target units, with σ² ≥ 10⁻⁴.
/// The delta is between observations, not inputs: two observations at equal
/// inputs have independent noise, and a new point shares none with the data,
/// so [`Covariance::add_cross`] adds nothing.
/// # Source
/// Eq. (5), last term; bound from sec. 3.
#[derive(Debug, Clone, PartialEq)]
pub struct Jitter {
    noise_std: f64,
}

impl Jitter {
    /// The noise term with standard deviation σ.
    ///
    /// The bound of sec. 3 binds a search, not this constructor.
    /// # Errors
    /// [`KernelError::NotPositive`] unless `noise_std` is finite and above zero.
    pub fn new(noise_std: f64) -> Result<Self, KernelError> {
        require_positive("noise_std", &[noise_std])?;
        Ok(Self { noise_std })
    }

    /// Standard deviation σ, in target units.
    pub fn noise_std(&self) -> f64 {
        self.noise_std
    }
}

impl Covariance for Jitter {
    fn layout(&self) -> ParamLayout {
        let bound = Transform::SquareAbove {
            floor: NOISE_VAR_FLOOR,
        };
        ParamLayout::new().with_scalar("noise_std", bound)
    }

    fn params(&self) -> Vec<f64> {
        vec![self.noise_std]
    }

    fn set_params(&mut self, theta: &[f64]) {
        assert_eq!(theta.len(), 1, "the noise term has one hyperparameter");
        self.noise_std = theta[0];
    }

    fn add_gram(&self, x: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        assert_eq!((out.nrows(), out.ncols()), (x.nrows(), x.nrows()));
        for idx in 0..x.nrows() {
            out[(idx, idx)] += self.noise_std * self.noise_std;
        }
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        assert_eq!((out.nrows(), out.ncols()), (x1.nrows(), x2.nrows()));
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        assert_eq!(out.len(), x.nrows());
        for value in out {
            *value += self.noise_std * self.noise_std;
        }
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (x.nrows(), x.nrows()));
        assert_eq!(gradient.len(), 1);
        // ∂K/∂σ = 2σI.
        let trace: f64 = (0..x.nrows()).map(|idx| adjoint[(idx, idx)]).sum();
        gradient[0] += 2.0 * self.noise_std * trace;
    }

    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (x1.nrows(), x2.nrows()));
        assert_eq!(gradient.len(), 1);
    }
}
