//! What the averages say about the chapter's claims: stated as found, never asserted.

use super::averages::{AverageKey, Averages, Table};
use super::text_table::{ratio, score};
use crate::cell::{CellRecord, FitSummary, ModelKind, TestSet};
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
    let mut findings = Vec::new();
    for (joint, set, n) in groups(averages) {
        let mean = |model| {
            averages.mean(&AverageKey {
                joint,
                model,
                set,
                n,
            })
        };
        let pairs = ORDER.windows(2).map(|pair| (pair[0], pair[1]));
        let found: Vec<_> = pairs
            .filter_map(|(better, worse)| Some((better, worse, mean(better)?, mean(worse)?)))
            .collect();
        if found.is_empty() {
            continue;
        }
        let exceptions: Vec<String> = found
            .iter()
            .filter(|(_, _, better, worse)| better > worse)
            .map(|(better, worse, a, b)| {
                let (a, b) = (score(Some(*a)), score(Some(*b)));
                format!(
                    "{} {a} is not better than {} {b}",
                    better.label(),
                    worse.label()
                )
            })
            .collect();
        let verdict = if exceptions.is_empty() {
            "the chapter's order".to_string()
        } else {
            exceptions.join("; ")
        };
        findings.push(format!(
            "joint {joint}, {}, n = {n}: {verdict}.",
            set.name()
        ));
    }
    findings
}

/// Cells of joint × set × size where extrap is less than ten times harder than interp.
///
/// # Source
/// Section 3.4: "at least an order of magnitude harder".
pub fn extrap_is_harder(averages: &Averages) -> Vec<String> {
    let interp = averages
        .0
        .iter()
        .filter(|(key, _)| key.set == TestSet::Interp);
    interp
        .filter_map(|(key, average)| {
            let extrap = averages.mean(&AverageKey {
                set: TestSet::Extrap,
                ..*key
            })?;
            let quotient = extrap / average.mean();
            let (joint, model, n) = (key.joint, key.model.label(), key.n);
            (quotient < 10.0).then(|| {
                let quotient = ratio(Some(quotient));
                format!("joint {joint}, {model}, n = {n}: extrap is {quotient} times interp.")
            })
        })
        .collect()
}

/// Where GPc is not better than LRc, on average and for single loads, with the fits behind it.
pub fn gpc_against_lrc(averages: &Averages, records: &[CellRecord], n: usize) -> Vec<String> {
    let mut findings = Vec::new();
    for (joint, set, _) in groups(averages).into_iter().filter(|group| group.2 == n) {
        let average = |model| {
            averages.0.get(&AverageKey {
                joint,
                model,
                set,
                n,
            })
        };
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
