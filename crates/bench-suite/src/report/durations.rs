//! Where the time went: thread-seconds of fits and predictions by model and size.

use std::collections::BTreeMap;

use super::text_table::TextTable;
use crate::cell::{CellRecord, ModelKind};

/// Heading of the table.
pub const TITLE: &str =
    "Thread-seconds of all cells when they were computed, fits + predictions of 60,000 points";

/// One row a model, one column a size; every entry sums over loads and joints.
pub fn by_model_and_size(records: &[CellRecord]) -> TextTable {
    let mut sums: BTreeMap<(ModelKind, usize), (f64, f64)> = BTreeMap::new();
    for record in records {
        let cell = &record.cell;
        let (fit, predict) = sums.entry((cell.model, cell.n)).or_default();
        *fit += record.seconds_fit;
        *predict += record.seconds_predict;
    }
    let mut sizes: Vec<usize> = sums.keys().map(|&(_, n)| n).collect();
    sizes.sort_unstable();
    sizes.dedup();

    let entry = |model: ModelKind, n: usize| match sums.get(&(model, n)) {
        Some((fit, predict)) => format!("{fit:.1} + {predict:.1}"),
        None => "–".to_string(),
    };
    let has_cells = |model: &ModelKind| sizes.iter().any(|&n| sums.contains_key(&(*model, n)));
    let row = |model: ModelKind| {
        let entries = sizes.iter().map(|&n| entry(model, n));
        std::iter::once(model.label().to_string())
            .chain(entries)
            .collect()
    };
    TextTable {
        header: std::iter::once("model".to_string())
            .chain(sizes.iter().map(|n| format!("n = {n}")))
            .collect(),
        rows: ModelKind::ALL
            .into_iter()
            .filter(has_cells)
            .map(row)
            .collect(),
        n_left: 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::averages::tests::record;

    #[test]
    fn loads_and_joints_add_up_and_a_size_without_cells_is_a_dash() {
        let mut records = [
            record(1, 1, ModelKind::GpCoulomb, 20, 1.0),
            record(3, 2, ModelKind::GpCoulomb, 20, 1.0),
            record(1, 1, ModelKind::LrCoulomb, 170, 1.0),
        ];
        for record in &mut records {
            (record.seconds_fit, record.seconds_predict) = (1.5, 0.25);
        }
        let table = by_model_and_size(&records);
        assert_eq!(table.header, ["model", "n = 20", "n = 170"]);
        assert_eq!(table.rows[0], ["LRc", "–", "1.5 + 0.2"]);
        assert_eq!(table.rows[1], ["GPc", "3.0 + 0.5", "–"]);
    }
}
