//! The hyperparameters of a torque covariance by name, and its two forms.

/// Whether the torque covariance has the Coulomb term.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TorqueForm {
    /// Eq. (5) only: the model GP¬c.
    Smooth,
    /// Eqs. (5) and (6): the model GPc.
    Coulomb,
}

/// Hyperparameters of a torque covariance, by name and in natural units.
///
/// ℓ is the number of joints; covariates are ordered (q, q̇, q̈).
#[derive(Debug, Clone, PartialEq)]
pub struct TorqueParams {
    /// b, in torque units.
    pub bias_std: f64,
    /// u, one per covariate (3ℓ), torque units per unit of the covariate.
    pub linear_std: Vec<f64>,
    /// v, in torque units.
    pub signal_std: f64,
    /// l, one per covariate (3ℓ), in its unit.
    pub length_scales: Vec<f64>,
    /// w, one per joint (ℓ), in torque units; `None` for GP¬c.
    pub coulomb_std: Option<Vec<f64>>,
}
