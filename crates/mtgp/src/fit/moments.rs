//! θ₀^x and σ₀ of A.3: the starts of eq. (22) on the data of all tasks together.

use gp_core::{StartKind, StartPoint, chapter_start, varied_start};
use kernels::TorqueCovariance;

use super::climb::Start;
use super::options::{MultiTaskOptions, Origin};
use super::parts::require_targets;
use crate::error::MtgpError;
use crate::layout::Stacked;

/// The start of eq. (22) on the pooled data, and its variations.
pub(super) fn moment_starts(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<Vec<Start<TorqueCovariance>>, MtgpError> {
    let chapter = pooled_moments(data, targets, options)?;
    let start = |kind: StartKind| {
        let point = varied_start(&chapter, kind)?;
        Ok(Start {
            origin: Origin::Moments(kind),
            covariance: point.covariance,
            noise_std: point.noise_std,
            is_near: false,
        })
    };
    // DEVIATION(A.3): the chapter's step 1 has the start of eq. (22) alone.
    (options.starts.kinds().iter())
        .map(|&kind| start(kind))
        .collect()
}

/// θ₀^x and σ₀ of A.3: eq. (22) on the data of all tasks together.
pub(super) fn pooled_moments(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<StartPoint, MtgpError> {
    require_targets(data, targets)?;
    Ok(chapter_start(data.covariates(), targets, options.form)?)
}
