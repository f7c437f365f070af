//! One K^ρ for all joints beside one for each: criteria and scores.

use super::curves::{CurveKey, Curves, Series, Statistic};
use super::finding::Finding;
use super::text_table::{TextTable, ratio};
use crate::cell::TestSet;
use crate::multi::ranks::Choices;
use crate::multi::shared::{SharedFitRecord, SharedRecord};

/// Heading of the section.
pub const TITLE: &str = "One K for all joints beside one for each";

/// What the table means.
pub const EXPLANATION: &str = "All joints share Λ, and each has its own θ and σ; the search sets out from the ends of the joints' own fits of the same rank.\nBIC counts the entries of Λ once; the rank of least BIC is in the figures.\nThe ratios are nMSE with one K over nMSE with one for each joint, averages over the contexts, geometric means over the joints.";

/// The BIC of the separate matrices and the common one, and the ratio of their scores, a row a size.
pub fn table(records: &[SharedRecord], choices: &Choices, curves: &Curves) -> TextTable {
    let header = [
        "draw",
        "n",
        "rank, one each",
        "rank, one for all",
        "BIC, one for all − one each",
        "interp",
        "extrap",
        "evaluations",
    ];
    let row = |record: &SharedRecord| -> Option<Vec<String>> {
        let (repeat, n) = (record.unit.repeat(), record.unit.n_total());
        let choice = choices.0.get(&(repeat, n))?;
        let shared = record.chosen()?;
        let quotient = |set| ratio(quotient(record, shared, curves, set));
        Some(vec![
            (repeat + 1).to_string(),
            n.to_string(),
            choice.rank.to_string(),
            shared.rank.to_string(),
            format!("{:+.0}", shared.bic - least_bic(choice)),
            quotient(TestSet::Interp),
            quotient(TestSet::Extrap),
            shared.evaluations.to_string(),
        ])
    };
    TextTable::new(0, header, records.iter().filter_map(row))
}

/// The question that section 5 asks, and what the criteria and the scores say.
///
/// # Source
/// Section 5: all A_i equal.
pub fn claims(records: &[SharedRecord], choices: &Choices, curves: &Curves) -> Vec<Finding> {
    let (mut preferred, mut better, mut all) = (0, 0, 0);
    for record in records {
        let key = (record.unit.repeat(), record.unit.n_total());
        let (Some(choice), Some(shared)) = (choices.0.get(&key), record.chosen()) else {
            continue;
        };
        all += 1;
        preferred += usize::from(shared.bic < least_bic(choice));
        let on_extrap = quotient(record, shared, curves, TestSet::Extrap);
        better += usize::from(on_extrap.is_some_and(|quotient| quotient < 1.0));
    }
    if all == 0 {
        return Vec::new();
    }
    vec![
        Finding::new(
            "(section 5 asks) is one K for all joints enough?",
            format!("BIC prefers it at {preferred} of {all} sizes"),
        ),
        Finding::new(
            "(section 5 asks) does it predict better?",
            format!("on extrap it has the lower error at {better} of {all} sizes"),
        ),
    ]
}

fn least_bic(choice: &crate::multi::ranks::Choice) -> f64 {
    let values = choice.bic.iter().map(|&(_, bic)| bic);
    values.fold(f64::INFINITY, f64::min)
}

/// Average nMSE with one K over that with one for each joint, geometric mean over the joints.
fn quotient(
    record: &SharedRecord,
    shared: &SharedFitRecord,
    curves: &Curves,
    set: TestSet,
) -> Option<f64> {
    let mut logs = 0.0;
    for (idx, unit) in record.unit.joints.iter().enumerate() {
        let key = CurveKey::new(unit.joint, set, Statistic::Average, Series::TransferBic);
        let nmses = shared.nmses(idx, set);
        let ours = nmses.iter().sum::<f64>() / nmses.len() as f64;
        logs += (ours / curves.at(&key, record.unit.n_total())?.value).ln();
    }
    Some((logs / record.unit.joints.len() as f64).exp())
}

/// Scores of every context and rank.
pub fn scores(records: &[SharedRecord]) -> String {
    let mut text = String::from("draw,joint,n,rank,context,set,nmse\n");
    for record in records {
        for fit in &record.fits {
            for (unit, scores) in record.unit.joints.iter().zip(&fit.scores) {
                let place = format!("{},{},{}", unit.repeat + 1, unit.joint, unit.n_total);
                for score in scores {
                    for set in TestSet::ALL {
                        let (rank, context, nmse) = (fit.rank, score.context, score.nmse(set));
                        let line = format!("{place},{rank},c{context},{},{nmse:e}\n", set.name());
                        text.push_str(&line);
                    }
                }
            }
        }
    }
    text
}

/// What the fits reported, a row a size and rank.
pub fn fits(records: &[SharedRecord]) -> String {
    let mut text = String::from(
        "draw,n,rank,initial_log_marginal_likelihood,log_marginal_likelihood,bic,evaluations,stop\n",
    );
    for record in records {
        for fit in &record.fits {
            let (draw, n) = (record.unit.repeat() + 1, record.unit.n_total());
            let log_marginal: f64 = fit.log_marginals.iter().sum();
            let (rank, start, bic) = (fit.rank, fit.initial_log_marginal, fit.bic);
            let (evaluations, stop) = (fit.evaluations, &fit.stop);
            let line = format!(
                "{draw},{n},{rank},{start:e},{log_marginal:e},{bic:e},{evaluations},{stop}\n"
            );
            text.push_str(&line);
        }
    }
    text
}
