//! The hysteresis states of the rows of a log.

use std::borrow::Cow;

use faer::Mat;

use crate::error::TorqueError;
use crate::rigid_body::log::Log;
use crate::rigid_body::unknowns::Unknowns;
use crate::samples::Samples;

/// States (q, q̇, q̈, z) of the rows of samples, in their order: z from the timeline's columns or times.
///
/// # Shapes
/// (n, 3ℓ + ℓ for each length).
/// # Errors
/// [`TorqueError::Log`] where the samples have neither; times that do not rise.
pub(crate) fn states_with_memory<'a>(
    samples: &'a Samples,
    unknowns: &Unknowns,
) -> Result<Cow<'a, Mat<f64>>, TorqueError> {
    let lengths = unknowns.lengths();
    if lengths.is_empty() {
        return Ok(Cow::Borrowed(&samples.x));
    }
    let log = Log::new(samples)?;
    log.require_memory(lengths)?;
    let n = samples.x.ncols();
    let mut states = Mat::zeros(samples.n_rows(), unknowns.n_covariates());
    for run in &log.runs {
        let mut z = vec![0.0; lengths.len() * samples.n_joints()];
        for (row, place) in run.rows.iter().enumerate() {
            log.advance(run, row, lengths, &mut z);
            for col in 0..n {
                states[(*place, col)] = samples.x[(*place, col)];
            }
            for (z, col) in z.iter().zip(n..) {
                states[(*place, col)] = *z;
            }
        }
    }
    Ok(Cow::Owned(states))
}
