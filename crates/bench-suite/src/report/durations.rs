//! Where the time went: thread-seconds of fits and predictions by model and size.

use std::collections::{BTreeMap, BTreeSet};

use super::text_table::TextTable;
use crate::cell::{CellRecord, ModelKind};
use crate::multi::model::MultiModel;
use crate::multi::unit::UnitRecord;

/// Heading of the table of cells.
pub const OF_CELLS: &str =
    "Thread-seconds of all cells when they were computed, fits + predictions of 60,000 points";

/// Heading of the table of units.
pub const OF_UNITS: &str = "Thread-seconds of all units when they were computed, fits + predictions of 64,000 points in every context";

/// Seconds of fits and of predictions, by row and size.
type Sums<R> = BTreeMap<(R, usize), (f64, f64)>;

/// One row a model, one column a size; every entry sums over loads and joints.
pub fn of_cells(records: &[CellRecord]) -> TextTable {
    let mut sums = Sums::new();
    for record in records {
        let place = (record.cell.model, record.cell.n);
        add(&mut sums, place, record.seconds_fit, record.seconds_predict);
    }
    let models: BTreeSet<ModelKind> = sums.keys().map(|&(model, _)| model).collect();
    let named = |model: ModelKind| (model, model.label().to_string());
    table(&sums, models.into_iter().map(named))
}

/// One row a model and one for all, one column a size; every entry sums over joints and draws.
pub fn of_units(records: &[UnitRecord]) -> TextTable {
    let mut sums = Sums::new();
    for record in records {
        for model in &record.models {
            for row in [Some(model.model), None] {
                let place = (row, record.unit.n_total);
                add(&mut sums, place, model.seconds_fit, model.seconds_predict);
            }
        }
    }
    let models: BTreeSet<MultiModel> = sums.keys().filter_map(|&(model, _)| model).collect();
    let named = |model: MultiModel| (Some(model), model.to_string());
    let rows = models.into_iter().map(named);
    table(&sums, rows.chain([(None, "all".to_string())]))
}

fn add<R: Ord>(sums: &mut Sums<R>, place: (R, usize), seconds_fit: f64, seconds_predict: f64) {
    let (fit, predict) = sums.entry(place).or_default();
    *fit += seconds_fit;
    *predict += seconds_predict;
}

fn table<R: Ord + Copy>(sums: &Sums<R>, rows: impl Iterator<Item = (R, String)>) -> TextTable {
    let sizes: BTreeSet<usize> = sums.keys().map(|&(_, n)| n).collect();
    let entry = |row, n| match sums.get(&(row, n)) {
        Some((fit, predict)) => format!("{fit:.1} + {predict:.1}"),
        None => "–".to_string(),
    };
    let header = sizes.iter().map(|n| format!("n = {n}"));
    let line = |(row, name): (R, String)| {
        let entries = sizes.iter().map(|&n| entry(row, n));
        std::iter::once(name).chain(entries).collect()
    };
    let header = std::iter::once("model".to_string()).chain(header);
    TextTable::new(1, header, rows.map(line))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::averages::tests::record;
    use crate::report::curves;

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
        let table = of_cells(&records);
        assert_eq!(table.header, ["model", "n = 20", "n = 170"]);
        assert_eq!(table.rows[0], ["LRc", "–", "1.5 + 0.2"]);
        assert_eq!(table.rows[1], ["GPc", "3.0 + 0.5", "–"]);
    }

    #[test]
    fn joints_add_up_and_all_models_too() {
        let record = curves::tests::record;
        let mut short = record(3, 280, [1.0; 5]);
        short.models.truncate(1);
        let table = of_units(&[record(1, 280, [1.0; 5]), short, record(1, 476, [1.0; 5])]);
        assert_eq!(table.header, ["model", "n = 280", "n = 476"]);
        assert_eq!(table.rows[0], ["sGP", "3.0 + 0.5", "1.5 + 0.2"]);
        assert_eq!(table.rows[5], ["all", "9.0 + 1.5", "7.5 + 1.2"]);
    }
}
