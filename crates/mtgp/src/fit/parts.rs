//! Parts of the data on which searches begin, each inside the next.

use gp_core::Starts;

use super::options::{MANY_SAMPLES, MultiTaskOptions};
use crate::error::MtgpError;
use crate::prior::Stacked;

/// Samples of all tasks together that the first search sees, about.
const FIRST_RUNG: usize = 280;

/// Samples of all tasks together that a search before the last sees at most.
///
/// Beyond, each doubling moves the optimum by little and costs more than all before it.
const LARGEST_RUNG: usize = 2240;

/// Fails unless there is one target per row.
pub(super) fn require_targets(data: &Stacked, targets: &[f64]) -> Result<(), MtgpError> {
    let (found, expected) = (targets.len(), data.tasks().len());
    if found == expected {
        return Ok(());
    }
    let what = "targets";
    Err(MtgpError::CountMismatch {
        what,
        found,
        expected,
    })
}

/// The parts of the data that are searched before the whole, each inside the next.
///
/// None with [`Starts::Chapter`].
pub(super) fn smaller_parts(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<Vec<(Stacked, Vec<f64>)>, MtgpError> {
    require_targets(data, targets)?;
    let sizes = match options.starts {
        Starts::Chapter => Vec::new(),
        Starts::Several => smaller_sizes(targets.len()),
    };
    let part = |n_samples: usize| part_of(data, targets, n_samples);
    sizes.into_iter().map(part).collect()
}

/// The part of the data that step 1 sees; `None` for all of them.
///
/// # Errors
/// As for [`super::fit_rank_from`].
pub(super) fn part_for_step_1(
    data: &Stacked,
    targets: &[f64],
    options: &MultiTaskOptions,
) -> Result<Option<(Stacked, Vec<f64>)>, MtgpError> {
    require_targets(data, targets)?;
    let is_part = options.starts == Starts::Several && targets.len() > MANY_SAMPLES;
    (is_part.then(|| part_of(data, targets, LARGEST_RUNG))).transpose()
}

/// About `n_samples` of the samples, spread evenly over those of each task.
fn part_of(
    data: &Stacked,
    targets: &[f64],
    n_samples: usize,
) -> Result<(Stacked, Vec<f64>), MtgpError> {
    let (part, rows) = data.spread(n_samples)?;
    let of_part = rows.iter().map(|&row| targets[row]).collect();
    Ok((part, of_part))
}

/// Numbers of samples of the searches before the last: 280, 560, …, up to ¾ of all and to 2240.
fn smaller_sizes(n_samples: usize) -> Vec<usize> {
    let doubled = std::iter::successors(Some(FIRST_RUNG), |n| Some(2 * n));
    let is_before_last = |n: &usize| *n <= LARGEST_RUNG && 4 * n <= 3 * n_samples;
    doubled.take_while(is_before_last).collect()
}

#[cfg(test)]
mod tests {
    use super::smaller_sizes;

    #[test]
    fn searches_double_their_samples_and_leave_the_last_step_its_own() {
        assert!(smaller_sizes(280).is_empty());
        assert_eq!(smaller_sizes(532), [280]);
        assert_eq!(smaller_sizes(1820), [280, 560, 1120]);
        let largest = [280, 560, 1120, 2240];
        assert_eq!(smaller_sizes(4000), largest);
        assert_eq!(smaller_sizes(56_000), largest);
    }
}
