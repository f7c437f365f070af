//! Where the time of the many-contexts experiments went: thread-seconds by model and size.

use std::collections::{BTreeMap, BTreeSet};

use super::text_table::TextTable;
use crate::multi::model::MultiModel;
use crate::multi::unit::UnitRecord;

/// Heading of the table.
pub const TITLE: &str = "Thread-seconds of all units when they were computed, fits + predictions of 64,000 points in every context";

/// One row a model and one for all, one column a size; every entry sums over joints and draws.
pub fn by_model_and_size(records: &[UnitRecord]) -> TextTable {
    let mut sums: BTreeMap<(Option<MultiModel>, usize), (f64, f64)> = BTreeMap::new();
    for record in records {
        for model in &record.models {
            for row in [Some(model.model), None] {
                let (fit, predict) = sums.entry((row, record.unit.n_total)).or_default();
                *fit += model.seconds_fit;
                *predict += model.seconds_predict;
            }
        }
    }
    let sizes: BTreeSet<usize> = sums.keys().map(|&(_, n)| n).collect();
    let models: BTreeSet<MultiModel> = sums.keys().filter_map(|&(model, _)| model).collect();
    let rows = models.into_iter().map(Some).chain([None]);
    let entry = |model, n| match sums.get(&(model, n)) {
        Some((fit, predict)) => format!("{fit:.1} + {predict:.1}"),
        None => "–".to_string(),
    };
    let row = |model: Option<MultiModel>| {
        let name = model.map_or("all".to_string(), |model| model.to_string());
        let entries = sizes.iter().map(|&n| entry(model, n));
        std::iter::once(name).chain(entries).collect()
    };
    TextTable {
        header: std::iter::once("model".to_string())
            .chain(sizes.iter().map(|n| format!("n = {n}")))
            .collect(),
        rows: rows.map(row).collect(),
        n_left: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::curves::tests::record;

    #[test]
    fn joints_add_up_and_all_models_too() {
        let mut short = record(3, 280, [1.0; 5]);
        short.models.truncate(1);
        let table = by_model_and_size(&[record(1, 280, [1.0; 5]), short, record(1, 476, [1.0; 5])]);
        assert_eq!(table.header, ["model", "n = 280", "n = 476"]);
        assert_eq!(table.rows[0], ["sGP", "3.0 + 0.5", "1.5 + 0.2"]);
        assert_eq!(table.rows[5], ["all", "9.0 + 1.5", "7.5 + 1.2"]);
    }
}
