//! Which of sGP, iGP, pGP and mGP-BIC has the lowest average nMSE where, counted.

use super::curves::{CurveKey, Curves, Series, Statistic};
use super::finding::Finding;
use super::text_table::{ratio, score};
use crate::cell::TestSet;

/// The averages of the four models at one joint, set and size.
struct Contest {
    joint: usize,
    n: usize,
    /// In the order of [`Series::ALL`].
    averages: [f64; 4],
}

impl Contest {
    fn average(&self, series: Series) -> f64 {
        let idx = Series::ALL.iter().position(|&s| s == series);
        idx.map_or(f64::NAN, |idx| self.averages[idx])
    }

    /// The model with the lowest average.
    fn winner(&self) -> Series {
        let all = Series::ALL.into_iter();
        all.min_by(|&a, &b| self.average(a).total_cmp(&self.average(b)))
            .unwrap_or(Series::Single)
    }
}

/// Every joint and size where all four models have a result.
fn contests(curves: &Curves, set: TestSet) -> Vec<Contest> {
    let mut contests = Vec::new();
    for joint in curves.joints() {
        for n in curves.sizes() {
            let average = |series| {
                let key = CurveKey::new(joint, set, Statistic::Average, series);
                curves.at(&key, n).map_or(f64::NAN, |point| point.value)
            };
            let averages = Series::ALL.map(average);
            if averages.iter().all(|value| !value.is_nan()) {
                contests.push(Contest { joint, n, averages });
            }
        }
    }
    contests
}

/// Sentences: how often mGP-BIC is lowest, where it is not, how often iGP beats sGP, and pGP on joint 1.
///
/// `at_least` is the number of wins expected, where the run is complete.
pub fn standings(curves: &Curves, set: TestSet, at_least: Option<usize>) -> Vec<String> {
    let contests = contests(curves, set);
    if contests.is_empty() {
        return Vec::new();
    }
    let mut found = vec![wins(&contests, at_least)];
    found.extend(losses(&contests));
    found.push(independent_against_single(&contests));
    found.extend(pooled_on_joint_1(&contests));
    found
}

/// The chapter's claims about the averages beside the counts.
///
/// # Source
/// Section 4.6.
pub fn claims(curves: &Curves, set: TestSet) -> Vec<Finding> {
    let contests = contests(curves, set);
    if contests.is_empty() {
        return Vec::new();
    }
    let of_four = Finding::new("mGP-BIC is best nearly everywhere", wins(&contests, None));
    let next = Finding::new(
        "iGP is better than sGP",
        independent_against_single(&contests),
    );
    let pooled = pooled_on_joint_1(&contests)
        .map(|here| Finding::new("pGP is close to mGP-BIC on joint 1", here));
    [of_four, next].into_iter().chain(pooled).collect()
}

fn wins(contests: &[Contest], at_least: Option<usize>) -> String {
    let won = |c: &&Contest| c.winner() == Series::TransferBic;
    let n_won = contests.iter().filter(won).count();
    let verdict = at_least.map_or(String::new(), |least| {
        let met = if n_won >= least { "met" } else { "not met" };
        format!(" (expected: at least {least}; {met})")
    });
    let all = contests.len();
    format!("mGP-BIC has the lowest average in {n_won} of {all} panels and sizes{verdict}.")
}

fn losses(contests: &[Contest]) -> Vec<String> {
    let lost = contests
        .iter()
        .filter(|c| c.winner() != Series::TransferBic);
    lost.map(|c| {
        let (winner, ours) = (c.winner(), c.average(Series::TransferBic));
        let best = c.average(winner);
        format!(
            "Not on joint {}, n = {}: {} {}, mGP-BIC {}, ratio {}.",
            c.joint,
            c.n,
            winner.name(),
            score(Some(best)),
            score(Some(ours)),
            ratio(Some(ours / best))
        )
    })
    .collect()
}

fn independent_against_single(contests: &[Contest]) -> String {
    let is_better = |c: &&Contest| c.average(Series::Independent) < c.average(Series::Single);
    let n_better = contests.iter().filter(is_better).count();
    let worse: Vec<String> = contests
        .iter()
        .filter(|c| !is_better(c))
        .map(|c| format!("joint {} at n = {}", c.joint, c.n))
        .collect();
    let all = contests.len();
    let exceptions = if worse.is_empty() {
        String::new()
    } else {
        format!("; not on {}", worse.join(", "))
    };
    format!("iGP is better than sGP in {n_better} of {all}{exceptions}.")
}

fn pooled_on_joint_1(contests: &[Contest]) -> Option<String> {
    let ratios: Vec<f64> = contests
        .iter()
        .filter(|c| c.joint == 1)
        .map(|c| c.average(Series::Pooled) / c.average(Series::TransferBic))
        .collect();
    let smallest = ratios.iter().copied().reduce(f64::min)?;
    let largest = ratios.iter().copied().reduce(f64::max)?;
    let (smallest, largest) = (ratio(Some(smallest)), ratio(Some(largest)));
    Some(format!(
        "On joint 1 the average of pGP is {smallest} to {largest} times that of mGP-BIC."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::curves::tests::{curves, record};

    #[test]
    fn wins_losses_and_the_joint_of_the_chapter_are_counted() {
        let curves = curves(&[
            record(1, 280, [8.0, 6.0, 2.0, 1.0, 9.0]),
            record(1, 476, [8.0, 6.0, 2.0, 4.0, 9.0]),
            record(3, 280, [5.0, 6.0, 7.0, 1.0, 9.0]),
        ]);
        let found = standings(&curves, TestSet::Interp, Some(3));
        assert_eq!(
            found,
            [
                "mGP-BIC has the lowest average in 2 of 3 panels and sizes (expected: at least 3; not met).",
                "Not on joint 1, n = 476: pGP 4.0e0, mGP-BIC 8.0e0, ratio 2.00.",
                "iGP is better than sGP in 2 of 3; not on joint 3 at n = 280.",
                "On joint 1 the average of pGP is 0.50 to 2.00 times that of mGP-BIC.",
            ]
        );
    }

    #[test]
    fn claims_stand_beside_the_counts() {
        let curves = curves(&[record(1, 280, [8.0, 6.0, 2.0, 1.0, 9.0])]);
        let found = claims(&curves, TestSet::Extrap);
        assert_eq!(found.len(), 3);
        assert_eq!(
            found[0].here,
            "mGP-BIC has the lowest average in 1 of 1 panels and sizes."
        );
    }

    #[test]
    fn a_model_without_a_result_is_no_contest() {
        let mut without = record(1, 280, [1.0; 5]);
        without.models.remove(0);
        assert!(standings(&curves(&[without]), TestSet::Interp, None).is_empty());
    }
}
