//! The bias term b² of eq. (5).

use faer::{MatMut, MatRef};
use linalg::{Threads, column_mut, column_panels, for_each_column, sums};

use crate::covariance::Covariance;
use crate::error::KernelError;
use crate::params::{ParamLayout, Transform};
use crate::positive::require_positive;

/// Columns of the Gram matrix that are worked on together.
const PANEL: usize = 128;

/// Covariance of an unknown constant.
///
/// ```text
/// c(x, x′) = b²
/// ```
/// θ = (`bias_std`), in target units.
/// # Source
/// Eq. (5), first term.
#[derive(Debug, Clone, PartialEq)]
pub struct Constant {
    bias_std: f64,
}

impl Constant {
    /// The bias term with standard deviation b.
    ///
    /// # Errors
    /// [`KernelError::NotPositive`] unless `bias_std` is finite and above zero.
    pub fn new(bias_std: f64) -> Result<Self, KernelError> {
        require_positive("bias_std", &[bias_std])?;
        Ok(Self { bias_std })
    }

    /// Standard deviation b, in target units.
    pub fn bias_std(&self) -> f64 {
        self.bias_std
    }

    fn variance(&self) -> f64 {
        self.bias_std * self.bias_std
    }
}

impl Covariance for Constant {
    fn layout(&self) -> ParamLayout {
        ParamLayout::new().with_scalar("bias_std", Transform::Positive)
    }

    fn params(&self) -> Vec<f64> {
        vec![self.bias_std]
    }

    fn set_params(&mut self, theta: &[f64]) {
        assert_eq!(theta.len(), 1, "the bias term has one hyperparameter");
        self.bias_std = theta[0];
    }

    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>) {
        assert_eq!((out.nrows(), out.ncols()), (x.nrows(), x.nrows()));
        let panels = column_panels(out, PANEL);
        Threads::at_hand(x.nrows()).for_each(panels, |(first, mut panel)| {
            for k in 0..panel.ncols() {
                for value in &mut column_mut(&mut panel, k)[first + k..] {
                    *value += self.variance();
                }
            }
        });
    }

    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, mut out: MatMut<'_, f64>) {
        assert_eq!((out.nrows(), out.ncols()), (x1.nrows(), x2.nrows()));
        for col_idx in 0..x2.nrows() {
            for value in column_mut(&mut out, col_idx) {
                *value += self.variance();
            }
        }
    }

    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]) {
        assert_eq!(out.len(), x.nrows());
        for value in out {
            *value += self.variance();
        }
    }

    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]) {
        assert_eq!((adjoint.nrows(), adjoint.ncols()), (x.nrows(), x.nrows()));
        assert_eq!(gradient.len(), 1);
        // ∂K/∂b = 2b·11′, so the gradient is 2b times the sum of all entries of Q.
        let n = x.nrows();
        let starts = (0..n).step_by(PANEL).collect();
        let parts = Threads::at_hand(n).map(starts, |first| {
            let mut sum = 0.0;
            for_each_column(adjoint.subcols(first, PANEL.min(n - first)), |k, column| {
                let below = sums::sum(&column[first + k + 1..]);
                sum += column[first + k] + 2.0 * below;
            });
            sum
        });
        gradient[0] += 2.0 * self.bias_std * parts.iter().sum::<f64>();
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
        for_each_column(adjoint, |_, column| {
            gradient[0] += 2.0 * self.bias_std * sums::sum(column);
        });
    }
}
