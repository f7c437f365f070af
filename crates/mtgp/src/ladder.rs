//! mGPs of several ranks, searched on a few of the samples first and then on more and more.
//!
//! From afar a search for Λ takes a thousand likelihoods or more, from nearby a few
//! dozen; so the many are computed where they are cheap.

use std::collections::BTreeMap;

use gp_core::Starts;

use crate::baselines::require_targets;
use crate::error::MtgpError;
use crate::prior::Stacked;
use crate::staged::{StageOne, fit_rank_from};
use crate::task_fit::{MANY_SAMPLES, MultiTaskOptions, TaskFit};

/// Samples of all tasks together that the first search sees, about.
const FIRST_RUNG: usize = 280;

/// Samples of all tasks together that a search before the last sees at most.
///
/// Beyond, each doubling moves the optimum by little and costs more than all before it.
const LARGEST_RUNG: usize = 2240;

/// Nats by which a higher rank must be more likely to be worth it.
const WORTH_A_RANK: f64 = 1.0;

/// Learns mGPs of several ranks.
///
/// Each rank sets out as A.3 says, from the rank below, and from its own end on about
/// half of the samples, but 2240 at most, whose search set out from half of those, and so on down to
/// some 280; they are spread evenly over the samples of each task.
/// The lowest rank that came within a nat of the highest likelihood on a part is searched
/// longest on the next, the others for a third of its evaluations.
/// With [`Starts::Chapter`] it is A.3 as it stands for every rank: all samples, one start.
/// # Shapes
/// `targets` (n,), N·m, in the order of the rows of `data`; the results stand in the
/// order of `ranks`.
/// # Errors
/// As for [`fit_rank_from`].
/// # Source
/// A.3, steps 2 and 3.
pub fn fit_ranks(
    data: &Stacked,
    targets: &[f64],
    ranks: &[usize],
    stage_one: &StageOne,
    options: &MultiTaskOptions,
) -> Result<Vec<TaskFit>, MtgpError> {
    fit_ranks_telling(data, targets, ranks, stage_one, options, &mut |_| ())
}

/// As [`fit_ranks`]; `tell` hears on how many samples the ranks are to be searched, before each round.
///
/// # Errors
/// As for [`fit_rank_from`].
pub fn fit_ranks_telling(
    data: &Stacked,
    targets: &[f64],
    ranks: &[usize],
    stage_one: &StageOne,
    options: &MultiTaskOptions,
    tell: &mut dyn FnMut(usize),
) -> Result<Vec<TaskFit>, MtgpError> {
    let mut rung = BTreeMap::new();
    // DEVIATION(A.3): the chapter searches on all samples from one start.
    for (part, of_part) in smaller_parts(data, targets, options)? {
        tell(of_part.len());
        let stage_one = StageOne::new(&part, &of_part, options)?;
        rung = next_rung(&part, &of_part, ranks, &stage_one, &rung, options)?;
    }
    tell(targets.len());
    let mut last = next_rung(data, targets, ranks, stage_one, &rung, options)?;
    let fits = ranks.iter().filter_map(|rank| last.remove(rank));
    Ok(fits.collect())
}

/// The mGPs by rank, from those on fewer samples.
fn next_rung(
    data: &Stacked,
    targets: &[f64],
    ranks: &[usize],
    stage_one: &StageOne,
    before: &BTreeMap<usize, TaskFit>,
    options: &MultiTaskOptions,
) -> Result<BTreeMap<usize, TaskFit>, MtgpError> {
    let is_chapter = options.starts == Starts::Chapter;
    let mut ascending = ranks.to_vec();
    ascending.sort_unstable();
    ascending.dedup();
    let leader = leader(before);
    let briefly = options.briefly(targets.len());
    let mut fits: BTreeMap<usize, TaskFit> = BTreeMap::new();
    for rank in ascending {
        let below = fits.values().next_back().filter(|_| !is_chapter);
        let warm: Vec<&TaskFit> = below.into_iter().chain(before.get(&rank)).collect();
        let is_other = leader.is_some_and(|leader| leader != rank);
        let options = if is_other { &briefly } else { options };
        let fit = fit_rank_from(data, targets, rank, stage_one, &warm, options)?;
        fits.insert(rank, fit);
    }
    Ok(fits)
}

/// The lowest rank within a nat of the highest likelihood; `None` before the first searches.
fn leader(fits: &BTreeMap<usize, TaskFit>) -> Option<usize> {
    let values = fits.values().map(TaskFit::log_marginal);
    let highest = values.reduce(f64::max)?;
    let is_leader = |fit: &TaskFit| fit.log_marginal() >= highest - WORTH_A_RANK;
    let mut ranks = fits.iter();
    ranks.find(|(_, fit)| is_leader(fit)).map(|(&rank, _)| rank)
}

/// The parts of the data that are searched before the whole, each inside the next.
///
/// None with [`Starts::Chapter`].
pub(crate) fn smaller_parts(
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
/// As for [`fit_rank_from`].
pub(crate) fn part_for_step_1(
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
