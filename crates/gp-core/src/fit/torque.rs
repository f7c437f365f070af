//! Learning the hyperparameters of one joint's torque by maximum marginal likelihood.

use faer::MatRef;
use kernels::TorqueForm;

use super::chapter_start::{chapter_start, varied_start};
use super::covariance::Fit;
use crate::data::{joints_of, require_training_data};
use crate::error::GpError;
use crate::search::{FitOptions, Plan, SearchScheme, Start};

/// Learns a joint's torque from data, without (GP¬c) or with (GPc) friction.
///
/// Maximises eq. (8) over the hyperparameters under σ² ≥ 10⁻⁴ and u ≤ 100, from
/// each start in turn, and keeps the highest likelihood.
/// Sequential and deterministic.
/// # Shapes
/// `x` (n, 3ℓ) with columns (q, q̇, q̈) in rad, rad/s, rad/s²; `targets` (n,), N·m.
/// # Errors
/// Fewer than 2 samples, data that is not finite (with its row and column) or
/// does not match, columns that are not three per joint, or no start with a
/// finite likelihood.
/// # Source
/// Sec. 3 and A.1.
pub fn fit(
    x: MatRef<'_, f64>,
    targets: &[f64],
    form: TorqueForm,
    options: &FitOptions,
) -> Result<Fit, GpError> {
    let chapter = chapter_start(x, targets, form, &options.continuous)?;
    let starts = (options.starts.origins().iter())
        .map(|origin| varied_start(&chapter, *origin))
        .collect::<Result<Vec<_>, _>>()?;
    fit_from(x, targets, &starts, options)
}

/// Learns a joint's torque from starts of the caller's choice, such as a fit to fewer data.
///
/// `options.starts` and `options.continuous` are not used: the starts say what they say.
/// # Errors
/// As for [`fit`]; also [`GpError::WrongCovariates`] for a start of another robot.
pub fn fit_from(
    x: MatRef<'_, f64>,
    targets: &[f64],
    starts: &[Start],
    options: &FitOptions,
) -> Result<Fit, GpError> {
    require_training_data(x, targets, 2)?;
    let n_joints = joints_of(x)?;
    if let Some(other) = starts.iter().find(|s| s.covariance.n_joints() != n_joints) {
        return Err(GpError::WrongCovariates {
            found: x.ncols(),
            expected: 3 * other.covariance.n_joints(),
        });
    }

    let (n_samples, limits) = (targets.len(), options.limits());
    let plan = match options.scheme {
        SearchScheme::Whole => Plan::whole(n_samples, limits),
        SearchScheme::Nested => Plan::nested(n_samples, limits),
    };
    Fit::climb(x, targets, starts, &plan, options.likelihood)
}
