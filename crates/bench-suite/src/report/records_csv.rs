//! Records as CSV: one row a cell and test set; the seconds, which no two runs share, in a file of their own.

use crate::cell::{CellRecord, TestSet};
use crate::fit_summary::FitSummary;
use crate::store::Work;

/// Names of the columns of a fit.
pub(super) const FIT_COLUMNS: &str = "log_marginal_likelihood,start,stop,iterations,evaluations,noise_std,method,rank,error_bound,recoveries,bounds_hit";

/// Results, the same text for the same cells whatever the machine's load or number of threads.
pub fn cells(records: &[CellRecord]) -> String {
    let mut text = format!("joint,load,model,n,set,nmse,{FIT_COLUMNS},record\n");
    for record in in_table_order(records) {
        let fit = record.fit.as_ref().map_or_else(no_fit, fit_columns);
        for set in TestSet::ALL {
            let (cell, nmse) = (cell_columns(record), format!("{:e}", record.nmse(set)));
            let file = record.cell.file_name();
            text.push_str(&[cell.as_str(), set.name(), &nmse, &fit, &file].join(","));
            text.push('\n');
        }
    }
    text
}

/// Wall-clock seconds, as measured when the cell was computed.
pub fn seconds(records: &[CellRecord]) -> String {
    let mut text = String::from("joint,load,model,n,seconds_fit,seconds_predict\n");
    for record in in_table_order(records) {
        let seconds = [record.seconds_fit, record.seconds_predict].map(|s| format!("{s:.6}"));
        text.push_str(&[cell_columns(record), seconds.join(",")].join(","));
        text.push('\n');
    }
    text
}

fn cell_columns(record: &CellRecord) -> String {
    let cell = &record.cell;
    format!(
        "{},c{},{},{}",
        cell.joint,
        cell.load,
        cell.model.name(),
        cell.n
    )
}

/// What a fit reported, under [`FIT_COLUMNS`]; the bounds are names separated by blanks.
pub(super) fn fit_columns(fit: &FitSummary) -> String {
    [
        format!("{}", fit.log_marginal_likelihood),
        fit.start.clone(),
        fit.stop.clone(),
        fit.iterations.to_string(),
        fit.evaluations.to_string(),
        format!("{:e}", fit.noise_std),
        fit.method.clone(),
        fit.rank.to_string(),
        format!("{:e}", fit.error_bound),
        fit.recoveries.to_string(),
        fit.bounds_hit.join(" "),
    ]
    .join(",")
}

/// Empty columns of a model without hyperparameters.
fn no_fit() -> String {
    ",".repeat(10)
}

fn in_table_order(records: &[CellRecord]) -> Vec<&CellRecord> {
    let mut order: Vec<&CellRecord> = records.iter().collect();
    order.sort_by_key(|r| (r.cell.joint, r.cell.model, r.cell.n, r.cell.load));
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::ModelKind;
    use crate::report::averages::tests::record;

    #[test]
    fn a_cell_is_two_rows_and_the_order_is_the_tables() {
        let records = [
            record(3, 1, ModelKind::LrCoulomb, 20, 0.25),
            record(1, 12, ModelKind::LrCoulomb, 20, 0.5),
        ];
        let text = cells(&records);
        let rows: Vec<&str> = text.lines().collect();
        let expected = [
            "1,c12,LRc,20,interp,5e-1,,,,,,,,,,,,",
            "3,c1,LRc,20,extrap,2.5e0,,,,,,,,,,,,",
        ];
        let files = [1, 0].map(|i: usize| records[i].cell.file_name());
        assert_eq!(rows[1], format!("{}{}", expected[0], files[0]));
        assert_eq!(rows[4], format!("{}{}", expected[1], files[1]));
        let columns = |row: &str| row.matches(',').count();
        assert!(
            rows.iter().all(|row| columns(row) == columns(rows[0])),
            "{text}"
        );
    }
}
