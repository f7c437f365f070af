//! Bayesian linear regression, the baseline LR of eq. (9).

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{ColMut, Mat, MatRef, Par};
use kernels::sgn;

use super::linear_evidence::{Standardised, most_evident};
use super::stacked_system::r_with_targets;
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
/// t ~ N(x̃ᵀβ, σ²),  β ~ N(0, τ²I),   σ² = 10⁻⁴,  τ² = 10⁴, or learned
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
    /// σ², in squared target units.
    noise_var: f64,
}

impl BayesLinear {
    /// Conditions the weights on data, with the variances of eq. (9).
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
        let ratio = (LINEAR_NOISE_VAR / WEIGHT_VAR).sqrt();
        let prior_rows = Mat::from_fn(p, p, |row, col| if row == col { ratio } else { 0.0 });
        let linear = Self {
            form,
            n_joints,
            weights: Vec::new(),
            r: Mat::new(),
            noise_var: LINEAR_NOISE_VAR,
        };
        Ok(linear.conditioned(&features, targets, prior_rows.as_ref()))
    }

    /// Conditions the weights on data, with variances that have the highest evidence.
    ///
    /// The weights of standardised features are N(0, τ²), that of the constant is any; σ² and τ² are those of the highest
    /// marginal likelihood of the targets less their mean.
    /// The result does not depend on the units of covariates and targets.
    /// # Shapes
    /// As for [`BayesLinear::fit`].
    /// # Errors
    /// As there, and fewer than 2 samples.
    /// # Source
    /// Evidence: MacKay 1992; Patterson & Thompson 1971 for the constant.
    // DEVIATION(eq. 9): the chapter's variances are fixed, for torques of an arm in N·m.
    pub fn fit_by_evidence(
        x: MatRef<'_, f64>,
        targets: &[f64],
        form: LinearForm,
    ) -> Result<Self, GpError> {
        Self::fit_correlated_by_evidence(x, targets, form, 1.0)
    }

    /// The same for samples of which c tell as much as one.
    ///
    /// ```text
    /// σ²A = X̃ᵀX̃/c + (σ/τ)²S²,   σ² and τ² by the evidence to the power 1/c
    /// ```
    /// so that n samples say what n/c independent ones would; σ² stays the variance of one target.
    ///
    /// Fewer than p + 1 independent samples could not tell noise from what is linear: beyond c = n/(p + 1) the weights and
    /// variances stay those of that c, and cov\[β\] goes on to grow with c.
    /// # Shapes
    /// As for [`BayesLinear::fit`].
    /// # Errors
    /// As for [`BayesLinear::fit_by_evidence`].
    /// # Panics
    /// If c is not at least 1.
    /// # Source
    /// Bayley & Hammersley 1946 for n/c.
    pub fn fit_correlated_by_evidence(
        x: MatRef<'_, f64>,
        targets: &[f64],
        form: LinearForm,
        correlation: f64,
    ) -> Result<Self, GpError> {
        assert!(correlation >= 1.0, "{correlation} samples for one");
        require_training_data(x, targets, 2)?;
        let n_joints = joints_of(x)?;
        let features = features(x, n_joints, form); // (n, p)
        let scales = Standardised::of(&features);
        let most = features.nrows() as f64 / (features.ncols() + 1) as f64;
        let tempered = correlation.min(most).max(1.0);
        let found = most_evident(&scales.of_rows(&features), targets, 1.0 / tempered);
        let linear = Self {
            form,
            n_joints,
            weights: Vec::new(),
            r: Mat::new(),
            noise_var: found.noise_var,
        };
        let prior_rows = scales.prior_rows(found.noise_to_weight);
        let root = (1.0 / tempered).sqrt();
        let weighted: Vec<f64> = targets.iter().map(|target| root * target).collect();
        let rows = faer::Scale(root) * features;
        let mut linear = linear.conditioned(&rows, &weighted, prior_rows.as_ref());
        linear.r *= faer::Scale((tempered / correlation).sqrt());
        Ok(linear)
    }

    /// The same model, with the weights' posterior given rows of x̃, and of σ/τ for the prior.
    fn conditioned(
        mut self,
        features: &Mat<f64>,
        targets: &[f64],
        prior_rows: MatRef<'_, f64>,
    ) -> Self {
        let p = features.ncols();
        let r = r_with_targets(features, targets, prior_rows); // (p + 1, p + 1)
        self.weights = (0..p).map(|row| r[(row, p)]).collect();
        self.r = r.submatrix(0, 0, p, p).to_owned();
        solve_upper_triangular_in_place(
            self.r.as_ref(),
            ColMut::from_slice_mut(&mut self.weights).as_mat_mut(),
            Par::Seq,
        );
        self
    }

    /// The posterior with given weights and R, as a model file holds them, and the noise of eq. (9).
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
            noise_var: LINEAR_NOISE_VAR,
        }
    }

    /// The same posterior with another noise variance, in squared target units.
    #[must_use]
    pub fn with_noise_var(self, noise_var: f64) -> Self {
        Self { noise_var, ..self }
    }

    /// σ², in squared target units.
    pub fn noise_var(&self) -> f64 {
        self.noise_var
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
            .map(|col| self.noise_var * squared_norm(col))
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
