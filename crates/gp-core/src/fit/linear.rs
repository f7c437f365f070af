//! Bayesian linear regression, the baseline LR of eq. (9).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{
    QrParams, qr_in_place, qr_in_place_scratch, recommended_block_size,
};
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Auto, ColMut, Mat, MatRef, Par, Spec};
use kernels::sgn;

use crate::data::{joints_of, require_inputs, require_training_data};
use crate::error::GpError;

/// Prior variance of each weight. Source: eq. (9), β ~ N(0, 10⁴ I).
pub const WEIGHT_VAR: f64 = 1e4;

/// Noise variance, in squared target units. Source: eq. (9), t ~ N(x̃ᵀβ, 10⁻⁴).
pub const LINEAR_NOISE_VAR: f64 = 1e-4;

/// Whether the linear model sees the signs of the joint velocities.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LinearForm {
    /// x̃ = (x, 1): the model LR¬c.
    Smooth,
    /// x̃ = (x, sgn(q̇), 1): the model LRc.
    Coulomb,
}

impl LinearForm {
    /// Length p of x̃: 3ℓ covariates, the signs if there are any, and the constant.
    pub fn n_features(self, n_joints: usize) -> usize {
        match self {
            Self::Smooth => 3 * n_joints + 1,
            Self::Coulomb => 4 * n_joints + 1,
        }
    }
}

/// Posterior over the weights of a linear model.
///
/// ```text
/// t ~ N(x̃ᵀβ, σ²),  β ~ N(0, τ²I),   σ² = 10⁻⁴,  τ² = 10⁴
/// E[β] = A⁻¹X̃ᵀt/σ²,  cov[β] = A⁻¹,   A = X̃ᵀX̃/σ² + I/τ²
/// ```
/// tᵀt/σ² can be 10¹⁰, so A is never formed.
/// σ²A = RᵀR comes from a QR decomposition of the rows of X̃ followed by (σ/τ)I,
/// and E\[β\] is the least-squares solution of that stacked system.
/// # Source
/// Eq. (9); Rasmussen & Williams 2006, sec. 2.1; Golub & Van Loan 2013, sec. 5.3.
#[derive(Debug, Clone)]
pub struct BayesLinear {
    form: LinearForm,
    n_joints: usize,
    weights: Vec<f64>,
    /// R in the upper triangle, (p, p).
    r: Mat<f64>,
}

impl BayesLinear {
    /// Conditions the weights on data.
    ///
    /// # Shapes
    /// `x` (n, 3ℓ) with columns (q, q̇, q̈); `targets` (n,).
    /// # Errors
    /// No sample, data that is not finite or does not match, or columns that are
    /// not three per joint.
    pub fn fit(x: MatRef<'_, f64>, targets: &[f64], form: LinearForm) -> Result<Self, GpError> {
        require_training_data(x, targets, 1)?;
        let n_joints = joints_of(x)?;
        let features = features(x, n_joints, form); // (n, p)
        let p = features.ncols();

        let mut r = r_with_targets(&features, targets); // (p + 1, p + 1)
        let mut weights: Vec<f64> = (0..p).map(|row| r[(row, p)]).collect();
        r = r.submatrix(0, 0, p, p).to_owned();
        solve_upper_triangular_in_place(
            r.as_ref(),
            ColMut::from_slice_mut(&mut weights).as_mat_mut(),
            Par::Seq,
        );
        Ok(Self {
            form,
            n_joints,
            weights,
            r,
        })
    }

    /// The posterior with given weights and R, as a model file holds them.
    ///
    /// # Panics
    /// If the shapes do not agree.
    pub fn from_parts(form: LinearForm, n_joints: usize, weights: Vec<f64>, r: Mat<f64>) -> Self {
        assert_eq!(weights.len(), form.n_features(n_joints));
        assert_eq!((r.nrows(), r.ncols()), (weights.len(), weights.len()));
        Self {
            form,
            n_joints,
            weights,
            r,
        }
    }

    /// Number of joints ℓ.
    pub fn n_joints(&self) -> usize {
        self.n_joints
    }

    /// R in the upper triangle, (p, p).
    pub fn r(&self) -> MatRef<'_, f64> {
        self.r.as_ref()
    }

    /// Posterior mean of β: covariates, then signs (LRc only), then the constant.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// With or without the signs of the velocities.
    pub fn form(&self) -> LinearForm {
        self.form
    }

    /// Posterior means x̃ᵀE\[β\] at the rows of `x`, in target units.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let features = self.checked_features(x)?;
        let mut means = vec![0.0; x.nrows()];
        for (col, weight) in self.weights.iter().enumerate() {
            for (mean, feature) in means.iter_mut().zip(features.col_as_slice(col)) {
                *mean += weight * feature;
            }
        }
        Ok(means)
    }

    /// Posterior variances x̃ᵀA⁻¹x̃ of the noise-free output at the rows of `x`.
    ///
    /// ```text
    /// x̃ᵀA⁻¹x̃ = σ² |R⁻ᵀx̃|²
    /// ```
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict_var(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let features = self.checked_features(x)?;
        let mut half = features.transpose().to_owned(); // (p, n)
        solve_lower_triangular_in_place(self.r.transpose(), half.as_mut(), Par::Seq);
        let squared_norm =
            |col: usize| -> f64 { half.col_as_slice(col).iter().map(|v| v * v).sum() };
        Ok((0..x.nrows())
            .map(|col| LINEAR_NOISE_VAR * squared_norm(col))
            .collect())
    }

    fn checked_features(&self, x: MatRef<'_, f64>) -> Result<Mat<f64>, GpError> {
        require_inputs(x, 3 * self.n_joints)?;
        Ok(features(x, self.n_joints, self.form))
    }
}

/// The augmented inputs x̃, one row per sample: (x, sgn q̇, 1), or (x, 1).
fn features(x: MatRef<'_, f64>, n_joints: usize, form: LinearForm) -> Mat<f64> {
    let n_signs = match form {
        LinearForm::Smooth => 0,
        LinearForm::Coulomb => n_joints,
    };
    let n_covariates = 3 * n_joints;
    Mat::from_fn(x.nrows(), n_covariates + n_signs + 1, |row, col| {
        if col < n_covariates {
            x[(row, col)]
        } else if col < n_covariates + n_signs {
            sgn(x[(row, n_joints + col - n_covariates)])
        } else {
            1.0
        }
    })
}

/// R of the QR decomposition of the stacked system with its right-hand side as last column.
///
/// ```text
/// [ X̃       t ]
/// [ (σ/τ)I  0 ]
/// ```
/// Its leading (p, p) block is R, and above the corner the last column is Qᵀ(t, 0).
fn r_with_targets(features: &Mat<f64>, targets: &[f64]) -> Mat<f64> {
    let (n, p) = (features.nrows(), features.ncols());
    let ratio = (LINEAR_NOISE_VAR / WEIGHT_VAR).sqrt();
    // One row more than unknowns, so that the last column has a place for its residual.
    let mut stacked = Mat::from_fn(n + p + 1, p + 1, |row, col| {
        if row < n {
            if col < p {
                features[(row, col)]
            } else {
                targets[row]
            }
        } else if row - n == col && col < p {
            ratio
        } else {
            0.0
        }
    });

    let (rows, cols) = (stacked.nrows(), stacked.ncols());
    let block_size = recommended_block_size::<f64>(rows, cols);
    let mut coefficients = Mat::zeros(block_size, cols);
    let params: Spec<QrParams, f64> = <QrParams as Auto<f64>>::auto().into();
    let scratch = qr_in_place_scratch::<f64>(rows, cols, block_size, Par::Seq, params);
    let mut memory = MemBuffer::new(scratch);
    qr_in_place(
        stacked.as_mut(),
        coefficients.as_mut(),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    );
    stacked.submatrix(0, 0, cols, cols).to_owned()
}
