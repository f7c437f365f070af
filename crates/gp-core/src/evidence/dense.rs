//! Eq. (8) and its gradient by a Cholesky factorisation of the whole matrix.

use std::f64::consts::PI;

use faer::{Mat, MatRef};
use kernels::{Covariance, Jitter};
use linalg::{Factor, Threads, column_panels};

use super::low_rank::rounding_of_entries;
use crate::error::GpError;

/// Columns that are worked on together where every entry is touched once.
const PANEL: usize = 128;

/// Memory of the dense path, which later evaluations use again.
///
/// Peak memory is two (n, n) matrices.
#[derive(Debug)]
pub(crate) struct Dense {
    gram: Mat<f64>,
    scratch: Mat<f64>,
    alpha: Vec<f64>,
}

/// Value of eq. (8) with the error that rounding K leaves in it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DenseValue {
    pub value: f64,
    pub rounding: f64,
}

impl Dense {
    /// Allocates nothing yet.
    pub fn new() -> Self {
        Self {
            gram: Mat::new(),
            scratch: Mat::new(),
            alpha: Vec::new(),
        }
    }

    /// α = K⁻¹t of the last gradient, (n,).
    pub fn alpha(&self) -> &[f64] {
        &self.alpha
    }

    /// The value of eq. (8).
    pub fn value<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
        x: MatRef<'_, f64>,
        targets: &[f64],
    ) -> Result<DenseValue, GpError> {
        let (factor, largest) = self.factorise(covariance, noise_std, x)?;
        let (quadratic, alpha) = factor.quadratic_form_and_solve(targets);
        let value = log_density(quadratic, &factor);
        self.gram = factor.into_buffer();
        Ok(DenseValue {
            value,
            rounding: rounding(&alpha, largest, noise_std),
        })
    }

    /// The value of eq. (8) and its gradient with respect to (θ, σ).
    ///
    /// # Panics
    /// If `gradient` does not have one entry per hyperparameter and one for σ.
    pub fn value_and_gradient<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
        x: MatRef<'_, f64>,
        targets: &[f64],
        gradient: &mut [f64],
    ) -> Result<DenseValue, GpError> {
        let n_params = covariance.n_params();
        assert_eq!(gradient.len(), n_params + 1);
        let (factor, largest) = self.factorise(covariance, noise_std, x)?;
        let (quadratic, alpha) = factor.quadratic_form_and_solve(targets);
        let value = log_density(quadratic, &factor);

        let n = targets.len();
        if self.scratch.nrows() != n {
            self.scratch = Mat::zeros(n, n);
        }
        let mut adjoint = factor.into_inverse(&mut self.scratch); // (n, n), lower
        half_outer_minus_half(&mut adjoint, &alpha);

        gradient.fill(0.0);
        let (of_theta, of_noise) = gradient.split_at_mut(n_params);
        covariance.gram_adjoint(x, adjoint.as_ref(), of_theta);
        Jitter::new(noise_std)?.gram_adjoint(x, adjoint.as_ref(), of_noise);
        self.gram = adjoint;
        let rounding = rounding(&alpha, largest, noise_std);
        self.alpha = alpha;
        Ok(DenseValue { value, rounding })
    }

    /// The factor of K = c(X, X) + σ²I, in the memory of `gram`, and max K_aa.
    fn factorise<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
        x: MatRef<'_, f64>,
    ) -> Result<(Factor, f64), GpError> {
        let n = x.nrows();
        let mut gram = std::mem::replace(&mut self.gram, Mat::new());
        if gram.nrows() == n {
            fill(&mut gram, 0.0);
        } else {
            gram = Mat::zeros(n, n);
        }
        covariance.add_gram(x, gram.as_mut());
        Jitter::new(noise_std)?.add_gram(x, gram.as_mut());
        let largest = (0..n).map(|idx| gram[(idx, idx)]).fold(0.0, f64::max);
        Ok((Factor::new(gram)?, largest))
    }
}

fn rounding(alpha: &[f64], largest: f64, noise_std: f64) -> f64 {
    let alpha_sq = alpha.iter().map(|a| a * a).sum();
    rounding_of_entries(alpha.len(), largest, noise_std * noise_std, alpha_sq)
}

/// −½ tᵀK⁻¹t − ½ log|K| − ½ n log 2π.
fn log_density(quadratic: f64, factor: &Factor) -> f64 {
    let n = factor.order() as f64;
    -0.5 * quadratic - 0.5 * factor.log_det() - 0.5 * n * (2.0 * PI).ln()
}

fn fill(matrix: &mut Mat<f64>, value: f64) {
    let panels = column_panels(matrix.as_mut(), PANEL);
    Threads::at_hand(panels.len() * PANEL).for_each(panels, |(_, mut panel)| panel.fill(value));
}

/// Turns the lower triangle of K⁻¹ into that of ½(αα′ − K⁻¹).
fn half_outer_minus_half(inverse: &mut Mat<f64>, alpha: &[f64]) {
    let panels = column_panels(inverse.as_mut(), PANEL);
    Threads::at_hand(alpha.len()).for_each(panels, |(first, panel)| {
        for (k, column) in panel.col_iter_mut().enumerate() {
            let alpha_col = alpha[first + k];
            let column = column
                .try_as_col_major_mut()
                .expect("columns of a Mat are contiguous");
            let lower = &mut column.as_slice_mut()[first + k..];
            for (entry, alpha_row) in lower.iter_mut().zip(&alpha[first + k..]) {
                *entry = 0.5 * (alpha_row * alpha_col - *entry);
            }
        }
    });
}
