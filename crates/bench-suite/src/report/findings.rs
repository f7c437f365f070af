//! What the averages say about the chapter's claims: stated as found, never asserted.

use super::agreement::Agreement;
use super::averages::{Average, AverageKey, Averages, Table};
use super::fig07;
use super::finding::Finding;
use super::text_table::{ratio, score};
use crate::cell::{CellRecord, ModelKind, TestSet};
use crate::fit_summary::FitSummary;
use crate::spec::Expectation;

/// Smallest size at which the order of the models is checked.
const ORDER_FROM: usize = 170;
/// The chapter's order, best first.
const ORDER: [ModelKind; 4] = [
    ModelKind::GpCoulomb,
    ModelKind::LrCoulomb,
    ModelKind::GpSmooth,
    ModelKind::LrSmooth,
];

/// Published rows that should be met, one sentence each.
pub fn beside_published(
    averages: &Averages,
    published: &Table,
    expect: &Expectation,
) -> Vec<String> {
    let is_checked =
        |key: &&AverageKey| key.model == expect.reference_model && key.n == expect.size;
    let keys = published.keys().filter(is_checked);
    keys.filter_map(|key| {
        let (ours, theirs) = (averages.mean(key)?, published[key]);
        let quotient = ours / theirs;
        let verdict = if quotient <= expect.worse_at_most {
            "within"
        } else {
            "MORE THAN"
        };
        Some(format!(
            "{}: {} against {theirs:.0e} published, ratio {}: {verdict} {} times.",
            name(key),
            score(Some(ours)),
            ratio(Some(quotient)),
            expect.worse_at_most
        ))
    })
    .collect()
}

/// Whether GPc ≥ LRc ≥ GP¬c ≥ LR¬c, per joint, set and size from n = 170 on.
///
/// # Source
/// Section 3.4.
pub fn order(averages: &Averages) -> Vec<String> {
    let sentence = |(group, exceptions): (String, Vec<String>)| {
        let verdict = if exceptions.is_empty() {
            "the chapter's order".to_string()
        } else {
            exceptions.join("; ")
        };
        format!("{group}: {verdict}.")
    };
    orders(averages).into_iter().map(sentence).collect()
}

/// In how many groups the order holds, beside the chapter's claim.
///
/// # Source
/// Section 3.4.
pub fn order_claim(averages: &Averages) -> Option<Finding> {
    let orders = orders(averages);
    let all = orders.len();
    let n_held = orders.iter().filter(|(_, e)| e.is_empty()).count();
    let here = format!(
        "this order in {n_held} of {all} combinations of joint, set and n from {ORDER_FROM} on"
    );
    let chapter = "from best to worst: GPc, LRc, GP¬c, LR¬c";
    (all > 0).then(|| Finding::new(chapter, here))
}

/// Joint, set and size, and the neighbours in the chapter's order that stand the other way round.
fn orders(averages: &Averages) -> Vec<(String, Vec<String>)> {
    let mut orders = Vec::new();
    for (joint, set, n) in groups(averages) {
        let mean = |model| averages.mean(&AverageKey::new(joint, model, set, n));
        let pairs = ORDER.windows(2).map(|pair| (pair[0], pair[1]));
        let found: Vec<_> = pairs
            .filter_map(|(better, worse)| Some((better, worse, mean(better)?, mean(worse)?)))
            .collect();
        if found.is_empty() {
            continue;
        }
        let exceptions = found
            .iter()
            .filter(|(_, _, better, worse)| better > worse)
            .map(|(better, worse, a, b)| {
                let (a, b) = (score(Some(*a)), score(Some(*b)));
                format!(
                    "{} {a} is not better than {} {b}",
                    better.label(),
                    worse.label()
                )
            });
        let group = format!("joint {joint}, {}, n = {n}", set.name());
        orders.push((group, exceptions.collect()));
    }
    orders
}

/// Cells of joint × set × size where extrap is less than ten times harder than interp.
///
/// # Source
/// Section 3.4: "at least an order of magnitude harder".
pub fn extrap_is_harder(averages: &Averages) -> Vec<String> {
    let easy = extrap_over_interp(averages).into_iter();
    easy.filter(|(_, quotient)| *quotient < 10.0)
        .map(|(key, quotient)| {
            let (joint, model, n) = (key.joint, key.model.label(), key.n);
            let quotient = ratio(Some(quotient));
            format!("joint {joint}, {model}, n = {n}: extrap is {quotient} times interp.")
        })
        .collect()
}

/// How much harder extrap is, beside the chapter's claim.
///
/// # Source
/// Section 3.4.
pub fn extrap_claim(averages: &Averages) -> Option<Finding> {
    let mut quotients: Vec<f64> = extrap_over_interp(averages)
        .into_iter()
        .map(|(_, quotient)| quotient)
        .collect();
    quotients.sort_by(f64::total_cmp);
    let (least, most) = (*quotients.first()?, *quotients.last()?);
    let n_hard = quotients.iter().filter(|q| **q >= 10.0).count();
    let here = format!(
        "at least ten times in {n_hard} of {} averages; {} to {} times in all",
        quotients.len(),
        ratio(Some(least)),
        ratio(Some(most))
    );
    Some(Finding::new(
        "extrap at least ten times harder than interp",
        here,
    ))
}

/// Average on extrap over that on interp, by the key of the latter.
fn extrap_over_interp(averages: &Averages) -> Vec<(AverageKey, f64)> {
    let interp = averages.0.iter();
    let interp = interp.filter(|(key, _)| key.set == TestSet::Interp);
    let quotient = |(key, average): (&AverageKey, &Average)| {
        let set = TestSet::Extrap;
        let extrap = averages.mean(&AverageKey { set, ..*key })?;
        Some((*key, extrap / average.mean()))
    };
    interp.filter_map(quotient).collect()
}

/// Smallest and largest average beside the chapter's.
///
/// # Source
/// Section 3.4: the range of fig. 7.
pub fn range_claim(averages: &Averages) -> Option<Finding> {
    let mut means: Vec<f64> = averages.0.values().map(Average::mean).collect();
    means.sort_by(f64::total_cmp);
    let (least, most) = (score(means.first().copied()), score(means.last().copied()));
    let (low, high) = (fig07::RANGE.low, fig07::RANGE.high);
    (!means.is_empty()).then(|| {
        Finding::new(
            format!("averages from {low:.0e} to {high:.0e}, over six joints and six sizes"),
            format!("from {least} to {most}, over those computed"),
        )
    })
}

/// How many of the published averages agree, are lower or higher.
///
/// # Source
/// Table 3.
pub fn table3_claim(averages: &Averages, published: &Table) -> Finding {
    let places: Vec<Agreement> = published
        .iter()
        .filter_map(|(key, theirs)| Some(Agreement::of(averages.mean(key)? / theirs)))
        .collect();
    let count = |place| places.iter().filter(|p| **p == place).count();
    let counts = Agreement::ALL.map(|place| format!("{} {}", count(place), place.range()));
    Finding::new(
        format!("{} averages with one significant figure", published.len()),
        format!(
            "{} of them computed; ratios: {}",
            places.len(),
            counts.join(", ")
        ),
    )
}

/// Where GPc is not better than LRc, on average and for single loads, with the fits behind it.
pub fn gpc_against_lrc(averages: &Averages, records: &[CellRecord], n: usize) -> Vec<String> {
    let mut findings = Vec::new();
    for (joint, set, _) in groups(averages).into_iter().filter(|group| group.2 == n) {
        let average = |model| averages.0.get(&AverageKey::new(joint, model, set, n));
        let (Some(gpc), Some(lrc)) = (average(ModelKind::GpCoulomb), average(ModelKind::LrCoulomb))
        else {
            continue;
        };
        let verdict = if gpc.mean() < lrc.mean() {
            "better"
        } else {
            "NOT better"
        };
        let quotient = ratio(Some(gpc.mean() / lrc.mean()));
        let finding = format!(
            "joint {joint}, {}, n = {n}: GPc is {verdict} than LRc on average ({quotient} of its nMSE)",
            set.name()
        );
        let worst = gpc.worst().map_or_else(String::new, |(load, share)| {
            format!("; load c{load} makes {:.0} % of GPc's sum", 100.0 * share)
        });
        let loads: Vec<String> = gpc
            .per_load
            .iter()
            .filter_map(|&(load, nmse)| {
                let other = lrc.per_load.iter().find(|(l, _)| *l == load)?.1;
                (nmse >= other).then(|| single_load(records, (joint, load, n), nmse, other))
            })
            .collect();
        let verdict = if loads.is_empty() {
            "; better for every load.".to_string()
        } else {
            format!("; not better for:{}", loads.concat())
        };
        findings.push(finding + &worst + &verdict);
    }
    findings
}

/// One load's two scores and the fit behind the first.
fn single_load(
    records: &[CellRecord],
    (joint, load, n): (usize, usize, usize),
    gpc: f64,
    lrc: f64,
) -> String {
    let is_it = |r: &&CellRecord| {
        let cell = &r.cell;
        (cell.joint, cell.load, cell.n, cell.model) == (joint, load, n, ModelKind::GpCoulomb)
    };
    let fit = records.iter().find(is_it).and_then(|r| r.fit.as_ref());
    let fit = fit.map_or_else(String::new, |fit| {
        let FitSummary {
            log_marginal_likelihood,
            start,
            stop,
            iterations,
            ..
        } = fit;
        format!(
            "; log likelihood {log_marginal_likelihood:.1} from start {start}, {iterations} iterations, {stop}"
        )
    });
    let (gpc, lrc) = (score(Some(gpc)), score(Some(lrc)));
    format!("\n    - c{load}: {gpc} against {lrc}{fit}")
}

/// Joint, set and size of every average from [`ORDER_FROM`] on, without repetition.
fn groups(averages: &Averages) -> Vec<(usize, TestSet, usize)> {
    let large = averages.0.keys().filter(|key| key.n >= ORDER_FROM);
    let mut groups: Vec<_> = large.map(|key| (key.joint, key.set, key.n)).collect();
    groups.sort_unstable();
    groups.dedup();
    groups
}

fn name(key: &AverageKey) -> String {
    let (model, set) = (key.model.label(), key.set.name());
    format!("{model}, joint {}, {set}, n = {}", key.joint, key.n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::averages::{published, tests::record};

    #[test]
    fn a_wrong_order_is_named_with_both_scores() {
        let records = [
            record(1, 1, ModelKind::GpCoulomb, 170, 3e-3),
            record(1, 1, ModelKind::LrCoulomb, 170, 2e-3),
            record(1, 1, ModelKind::GpSmooth, 170, 4e-3),
        ];
        let averages = Averages::of(&records);
        let found = order(&averages);
        assert_eq!(
            found[0],
            "joint 1, interp, n = 170: GPc 3.0e-3 is not better than LRc 2.0e-3."
        );
        let found = gpc_against_lrc(&averages, &records, 170);
        assert!(
            found[0].contains("GPc is NOT better than LRc on average (1.50 of its nMSE)"),
            "{found:?}"
        );
        assert!(
            found[0].contains("not better for:\n    - c1: 3.0e-3 against 2.0e-3"),
            "{found:?}"
        );
    }

    #[test]
    fn published_rows_are_judged_by_the_ratio() {
        let averages = Averages::of(&[record(1, 1, ModelKind::LrCoulomb, 170, 22e-6)]);
        let expect = Expectation {
            reference_model: ModelKind::LrCoulomb,
            worse_at_most: 3.0,
            size: 170,
        };
        let found = beside_published(&averages, &published().unwrap(), &expect);
        assert!(
            found[0].ends_with("ratio 3.14: MORE THAN 3 times."),
            "{found:?}"
        );
        assert!(found[1].ends_with("within 3 times."), "{found:?}");
    }

    #[test]
    fn a_hard_interp_set_is_named() {
        // record() makes extrap ten times interp; the second cell is only five times.
        let mut easy = record(3, 1, ModelKind::LrCoulomb, 20, 1.0);
        easy.nmse_extrap = 5.0;
        let averages = Averages::of(&[record(1, 1, ModelKind::LrCoulomb, 20, 1.0), easy]);
        assert_eq!(
            extrap_is_harder(&averages),
            ["joint 3, LRc, n = 20: extrap is 5.00 times interp."]
        );
    }
}
