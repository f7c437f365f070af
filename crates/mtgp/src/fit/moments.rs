//! θ₀^x and σ₀ of A.3: the starts of eq. (22) on the data of all tasks together.

use gp_core::GpError;
use gp_core::fit::{chapter_start, varied_start};
use gp_core::search::Start;

use super::options::MultiTaskOptions;
use super::parts::require_targets;
use crate::error::MtgpError;
use crate::prior::Stacked;

/// The start of eq. (22) on the pooled data, and its variations.
pub(super) fn moment_starts(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<Vec<Start>, MtgpError> {
    let chapter = pooled_moments(data, targets, options)?;
    // DEVIATION(A.3): the chapter's step 1 has the start of eq. (22) alone.
    let starts: Result<Vec<Start>, GpError> = (options.starts.origins().iter())
        .map(|&origin| varied_start(&chapter, origin))
        .collect();
    Ok(starts?)
}

/// θ₀^x and σ₀ of A.3: eq. (22) on the data of all tasks together.
pub(super) fn pooled_moments(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<Start, MtgpError> {
    require_targets(data, targets)?;
    let MultiTaskOptions {
        form, continuous, ..
    } = options;
    Ok(chapter_start(
        data.covariates(),
        targets,
        *form,
        continuous,
    )?)
}
