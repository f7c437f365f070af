//! How the searches for hyperparameters ended, by model and size.

use std::collections::BTreeMap;

use super::text_table::TextTable;
use crate::cell::{CellRecord, ModelKind};

/// Heading of the table.
pub const TITLE: &str = "Fits by the reason why the search that won ended, with the median of its projected gradient and of the evaluations on all samples";

/// One row a model and size; a column for each reason that occurs.
pub fn by_model_and_size(records: &[CellRecord]) -> TextTable {
    let mut groups: BTreeMap<(ModelKind, usize), Vec<Winner>> = BTreeMap::new();
    for record in records {
        if let Some(winner) = Winner::of(record) {
            let group = groups.entry((record.cell.model, record.cell.n));
            group.or_default().push(winner);
        }
    }
    let mut reasons: Vec<&str> = groups.values().flatten().map(|w| w.stop).collect();
    reasons.sort_unstable();
    reasons.dedup();

    let row = |(key, winners): (&(ModelKind, usize), &Vec<Winner>)| {
        let count = |reason: &&str| winners.iter().filter(|w| w.stop == *reason).count();
        let mut row = vec![key.0.label().to_string(), key.1.to_string()];
        row.extend(reasons.iter().map(|reason| count(reason).to_string()));
        row.push(format!("{:.1e}", median(winners, |w| w.gradient)));
        row.push(format!("{:.0}", median(winners, |w| w.evaluations as f64)));
        row
    };
    let header = ["model", "n"].into_iter().chain(reasons.iter().copied());
    TextTable::new(
        1,
        header.chain(["gradient", "evaluations"]),
        groups.iter().map(row),
    )
}

/// The search that a fit comes from, and what all searches on its samples took.
struct Winner<'a> {
    stop: &'a str,
    gradient: f64,
    evaluations: usize,
}

impl<'a> Winner<'a> {
    fn of(record: &'a CellRecord) -> Option<Self> {
        let fit = record.fit.as_ref()?;
        let on_all = || fit.starts.iter().filter(|s| s.samples == record.cell.n);
        let value = fit.log_marginal_likelihood.to_bits();
        let winner = on_all().find(|s| s.log_marginal_likelihood.to_bits() == value)?;
        Some(Self {
            stop: &fit.stop,
            gradient: winner.projected_gradient,
            evaluations: on_all().map(|s| s.evaluations).sum(),
        })
    }
}

/// The middle value, the lower one of two.
fn median(winners: &[Winner<'_>], of: impl Fn(&Winner<'_>) -> f64) -> f64 {
    let mut values: Vec<f64> = winners.iter().map(of).collect();
    values.sort_by(f64::total_cmp);
    values[(values.len() - 1) / 2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit_summary::tests::{start, summary};
    use crate::fit_summary::{FitSummary, StartSummary};
    use crate::report::averages::tests::record;

    fn fitted(load: usize, stop: &str, projected_gradient: f64) -> CellRecord {
        let search = |samples, log_marginal_likelihood| StartSummary {
            samples,
            log_marginal_likelihood,
            projected_gradient,
            stop: stop.into(),
            ..start()
        };
        let mut record = record(1, load, ModelKind::GpCoulomb, 1004, 0.1);
        record.fit = Some(FitSummary {
            log_marginal_likelihood: 5.0,
            stop: stop.into(),
            starts: vec![search(251, 1.0), search(1004, 4.0), search(1004, 5.0)],
            ..summary()
        });
        record
    }

    #[test]
    fn reasons_are_counted_and_only_searches_on_all_samples_too() {
        let records = [
            fitted(1, "work-limit", 0.5),
            fitted(2, "gradient-small", 1e-3),
            fitted(3, "gradient-small", 2e-4),
            record(1, 1, ModelKind::LrCoulomb, 1004, 0.1),
        ];
        let table = by_model_and_size(&records);
        assert_eq!(
            table.header,
            [
                "model",
                "n",
                "gradient-small",
                "work-limit",
                "gradient",
                "evaluations"
            ]
        );
        assert_eq!(table.rows, [["GPc", "1004", "2", "1", "1.0e-3", "20"]]);
    }
}
