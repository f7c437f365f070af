//! Fits that needed help: another start than the chapter's, a line search begun anew, a bound, a limit.

use std::collections::BTreeMap;

use super::text_table::TextTable;
use crate::cell::CellRecord;
use crate::fit_summary::FitSummary;
use crate::multi::unit::UnitRecord;

/// Heading of the tables.
pub const TITLE: &str = "Fits that needed help";

/// How the columns are read.
pub const EXPLANATION: &str = "\
Counted are fits, each under every kind of help that it had:

- *other start*: the highest likelihood was reached from another start than the chapter's, which are eq. (22), and pGP or iGP for an mGP.
- *restarted*: in one of its searches a line search failed, and the search set out again along the gradient.
- *σ on bound*: the noise ended at the chapter's least, σ² = 10⁻⁴.
- *other bound*: another hyperparameter ended on a bound.
- *limit*: the search that won stopped at its limit of evaluations or work, not at a maximum.
- *undefined start*: a start where the likelihood cannot be computed was given up.";

/// Starts that are the chapter's: eq. (22), and the models that stage 3 of A.3 goes on from.
///
/// A rigid-body model without a process sets out from its prior.
const CHAPTERS: [&str; 4] = ["eq22", "pGP", "iGP", "prior"];

/// Counts over a group of fits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Counts {
    all: usize,
    other_start: usize,
    restarted: usize,
    noise_bound: usize,
    other_bound: usize,
    limit: usize,
    undefined: usize,
}

impl Counts {
    fn add(&mut self, fit: &FitSummary) {
        let one = |condition: bool| usize::from(condition);
        let is_noise = |name: &String| name == "noise_std";
        self.all += 1;
        self.other_start += one(!CHAPTERS.contains(&fit.start.as_str()));
        self.restarted += one(fit.recoveries > 0);
        self.noise_bound += one(fit.bounds_hit.iter().any(is_noise));
        self.other_bound += one(!fit.bounds_hit.iter().all(is_noise));
        self.limit += one(fit.stop.ends_with("-limit"));
        self.undefined += one(fit.starts.iter().any(|s| s.stop == "start-undefined"));
    }

    fn columns(self) -> Vec<String> {
        let counts = [
            self.all,
            self.other_start,
            self.restarted,
            self.noise_bound,
            self.other_bound,
            self.limit,
            self.undefined,
        ];
        counts.map(|count| count.to_string()).to_vec()
    }
}

/// One row a model and size of the experiments with one context.
pub fn of_cells(records: &[CellRecord]) -> TextTable {
    let mut groups = BTreeMap::new();
    for record in records {
        if let Some(fit) = &record.fit {
            let key = (record.cell.model, record.cell.n);
            groups.entry(key).or_insert_with(Counts::default).add(fit);
        }
    }
    let groups = groups.into_iter();
    table(groups.map(|((model, n), counts)| (model.label().to_string(), n, counts)))
}

/// One row a model and size of the experiments with many contexts.
pub fn of_units(records: &[UnitRecord]) -> TextTable {
    let mut groups = BTreeMap::new();
    for record in records {
        for model in record.models.iter().filter(|model| !model.fits.is_empty()) {
            let key = (model.model, record.unit.n_total);
            let counts = groups.entry(key).or_insert_with(Counts::default);
            model.fits.iter().for_each(|fit| counts.add(fit));
        }
    }
    let groups = groups.into_iter();
    table(groups.map(|((model, n), counts)| (model.to_string(), n, counts)))
}

fn table(groups: impl Iterator<Item = (String, usize, Counts)>) -> TextTable {
    let header = [
        "model",
        "n",
        "fits",
        "other start",
        "restarted",
        "σ on bound",
        "other bound",
        "limit",
        "undefined start",
    ];
    let row = |(model, n, counts): (String, usize, Counts)| {
        let first = [model, n.to_string()].into_iter();
        first.chain(counts.columns()).collect()
    };
    TextTable::new(1, header, groups.map(row))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::ModelKind;
    use crate::fit_summary::tests::summary;
    use crate::report::averages::tests::record;
    use crate::report::curves;

    /// A fit with the fields that are counted.
    fn fit(start: &str, stop: &str, recoveries: usize, bounds: &[&str]) -> FitSummary {
        FitSummary {
            start: start.into(),
            stop: stop.into(),
            recoveries,
            bounds_hit: bounds.iter().map(ToString::to_string).collect(),
            ..summary()
        }
    }

    #[test]
    fn every_kind_of_help_is_counted_once_a_fit() {
        let fits = [
            fit("eq22", "gradient-small", 0, &[]),
            fit("slow-in-rates", "work-limit", 2, &["noise_std"]),
            fit(
                "eq22",
                "evaluation-limit",
                0,
                &["noise_std", "linear_std[3]", "linear_std[4]"],
            ),
        ];
        let mut records = fits.map(|fit| {
            let mut record = record(1, 1, ModelKind::GpCoulomb, 20, 1.0);
            record.fit = Some(fit);
            record
        });
        records[2].cell.n = 170;
        let table = of_cells(&records);
        assert_eq!(
            table.rows[0],
            ["GPc", "20", "2", "1", "1", "1", "0", "1", "0"]
        );
        assert_eq!(
            table.rows[1],
            ["GPc", "170", "1", "0", "0", "1", "1", "1", "0"]
        );
    }

    #[test]
    fn the_models_of_a_unit_are_rows_and_start_from_igp_as_in_the_chapter() {
        let table = of_units(&[curves::tests::record(1, 280, [1.0; 5])]);
        assert_eq!(table.rows.len(), 5);
        assert_eq!(table.rows[3][..4], ["mGP-2", "280", "1", "0"]);
    }
}
