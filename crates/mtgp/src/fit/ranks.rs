//! mGPs of several ranks, searched on a few of the samples first and then on more and more.
//!
//! From afar a search for Λ takes a thousand likelihoods or more, from nearby a few
//! dozen; so the many are computed where they are cheap.

use std::collections::BTreeMap;

use gp_core::Starts;

use super::options::MultiTaskOptions;
use super::parts::smaller_parts;
use super::staged::{StageOne, fit_rank_from};
use super::task_fit::TaskFit;
use crate::error::MtgpError;
use crate::prior::Stacked;

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
