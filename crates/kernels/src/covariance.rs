//! The one contract of every covariance: its values, and the adjoint of its values.

use faer::{Mat, MatMut, MatRef};

use crate::params::ParamLayout;

/// A positive semi-definite function c(x, x′) with hyperparameters θ.
///
/// The methods that start with `add_` accumulate, so that a sum of covariances
/// needs no matrix of its own per term.
/// No method allocates a matrix of the size of the Gram matrix.
///
/// # Shapes
/// `x` (n, d), one sample per row; `out` matrices have contiguous columns.
pub trait Covariance: Send + Sync {
    /// Names and bounds of the hyperparameters, in θ order.
    fn layout(&self) -> ParamLayout;

    /// The hyperparameters θ in natural units: standard deviations, length scales, factors.
    fn params(&self) -> Vec<f64>;

    /// Replaces θ without judging it.
    ///
    /// A search may try values that overflow; the matrices then hold NaN or
    /// infinities, which a factorisation refuses.
    /// # Panics
    /// If the length is not that of [`Covariance::params`].
    fn set_params(&mut self, theta: &[f64]);

    /// Adds the Gram matrix to the lower triangle of `out`.
    ///
    /// ```text
    /// out_ab += c(x_a, x_b)      a ≥ b
    /// ```
    /// Entries above the diagonal are left unspecified.
    /// # Panics
    /// If `out` is not (n, n) with contiguous columns, or `x` has the wrong number of columns.
    fn add_gram(&self, x: MatRef<'_, f64>, out: MatMut<'_, f64>);

    /// Adds the covariances between two sets of inputs.
    ///
    /// ```text
    /// out_ab += c(x1_a, x2_b)
    /// ```
    /// # Shapes
    /// `x1` (n1, d), `x2` (n2, d), `out` (n1, n2).
    /// # Panics
    /// On other shapes, or if the columns of `out` are not contiguous.
    fn add_cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>, out: MatMut<'_, f64>);

    /// Adds the prior variances c(x_a, x_a), the diagonal of the Gram matrix.
    ///
    /// # Panics
    /// If `out` does not have one entry per row of `x`.
    fn add_diag(&self, x: MatRef<'_, f64>, out: &mut [f64]);

    /// Adds the gradient of a weighted sum of all Gram entries.
    ///
    /// ```text
    /// gradient_i += ∂/∂θ_i tr(QᵀK) = Σ_ab Q_ab ∂c(x_a, x_b)/∂θ_i
    /// ```
    /// With Q = ½(αα′ − K⁻¹) this is the gradient of eq. (8).
    /// # Shapes
    /// `adjoint` is the symmetric Q, (n, n); only its lower triangle is read.
    /// `gradient` has one entry per hyperparameter, in θ order.
    /// # Panics
    /// On other shapes.
    fn gram_adjoint(&self, x: MatRef<'_, f64>, adjoint: MatRef<'_, f64>, gradient: &mut [f64]);

    /// Adds the gradient of a weighted sum of the covariances between two sets of inputs.
    ///
    /// ```text
    /// gradient_i += Σ_ab Q_ab ∂c(x1_a, x2_b)/∂θ_i
    /// ```
    /// # Shapes
    /// `x1` (n1, d), `x2` (n2, d), `adjoint` Q (n1, n2), which need not be symmetric.
    /// `gradient` has one entry per hyperparameter, in θ order.
    /// # Panics
    /// On other shapes.
    fn cross_adjoint(
        &self,
        x1: MatRef<'_, f64>,
        x2: MatRef<'_, f64>,
        adjoint: MatRef<'_, f64>,
        gradient: &mut [f64],
    );

    /// θ with what has faded brought back to where it is just heard.
    ///
    /// A weight that has run off to zero, or a length scale to infinity, has no gradient left
    /// by which a search could find it again.
    /// Here each comes back to where its term adds an amount of standard deviation
    /// `amplitude` to the function: little beside the noise, and enough for a gradient.
    /// A covariance without such hyperparameters returns θ as it is.
    /// # Panics
    /// If `x` has the wrong number of columns.
    fn revived(&self, x: MatRef<'_, f64>, amplitude: f64) -> Vec<f64> {
        let _ = (x, amplitude);
        self.params()
    }

    /// Number of hyperparameters.
    fn n_params(&self) -> usize {
        self.params().len()
    }

    /// The symmetric Gram matrix K, (n, n), both triangles filled.
    fn gram(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut k_xx = Mat::zeros(x.nrows(), x.nrows());
        self.add_gram(x, k_xx.as_mut());
        for col in 1..x.nrows() {
            for row in 0..col {
                k_xx[(row, col)] = k_xx[(col, row)];
            }
        }
        k_xx
    }

    /// The covariances between two sets of inputs, (n1, n2).
    fn cross(&self, x1: MatRef<'_, f64>, x2: MatRef<'_, f64>) -> Mat<f64> {
        let mut k_12 = Mat::zeros(x1.nrows(), x2.nrows());
        self.add_cross(x1, x2, k_12.as_mut());
        k_12
    }

    /// The prior variances, (n,).
    fn diag(&self, x: MatRef<'_, f64>) -> Vec<f64> {
        let mut variances = vec![0.0; x.nrows()];
        self.add_diag(x, &mut variances);
        variances
    }
}
