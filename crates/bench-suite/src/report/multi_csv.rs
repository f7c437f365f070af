//! Units as CSV: one row a model, context and set; the curves; the seconds, which no two runs share.

use super::curves::Curves;
use super::records_csv::{FIT_COLUMNS, fit_columns};
use crate::cell::TestSet;
use crate::multi::unit::{ModelRecord, UnitRecord};
use crate::store::Work;

/// Scores of every context, the same text whatever the number of threads.
pub fn scores(records: &[UnitRecord]) -> String {
    let mut text = String::from("draw,joint,n,model,context,set,nmse,record\n");
    for (unit, model, file) in each_model(records) {
        for score in &model.scores {
            for set in TestSet::ALL {
                let (context, nmse) = (score.context, score.nmse(set));
                let line = format!("{unit},c{context},{},{nmse:e},{file}\n", set.name());
                text.push_str(&line);
            }
        }
    }
    text
}

/// What the fits reported, one row a fit: sGP has one a context.
pub fn fits(records: &[UnitRecord]) -> String {
    let mut text = format!("draw,joint,n,model,fit,{FIT_COLUMNS},record\n");
    for (unit, model, file) in each_model(records) {
        for (i, fit) in model.fits.iter().enumerate() {
            let line = format!("{unit},{},{},{file}\n", i + 1, fit_columns(fit));
            text.push_str(&line);
        }
    }
    text
}

/// Wall-clock seconds, as measured when the unit was computed.
pub fn seconds(records: &[UnitRecord]) -> String {
    let mut text = String::from("draw,joint,n,model,seconds_fit,seconds_predict\n");
    for (unit, model, _) in each_model(records) {
        let (fit, predict) = (model.seconds_fit, model.seconds_predict);
        let line = format!("{unit},{fit:.6},{predict:.6}\n");
        text.push_str(&line);
    }
    text
}

/// The lines of figures 10 and 11.
pub fn curves(curves: &Curves) -> String {
    let mut text = String::from("joint,set,statistic,series,n,value,low,high\n");
    for (key, points) in &curves.0 {
        for point in points {
            let (set, statistic, series) =
                (key.set.name(), key.statistic.name(), key.series.name());
            let numbers = [point.value, point.low, point.high].map(|v| format!("{v:e}"));
            let (joint, n, numbers) = (key.joint, point.n, numbers.join(","));
            let line = format!("{joint},{set},{statistic},{series},{n},{numbers}\n");
            text.push_str(&line);
        }
    }
    text
}

/// Every model of every unit with its first four columns and the unit's file, in the order draw, joint, n, model.
fn each_model(records: &[UnitRecord]) -> impl Iterator<Item = (String, &ModelRecord, String)> {
    let mut order: Vec<&UnitRecord> = records.iter().collect();
    order.sort_by_key(|r| (r.unit.repeat, r.unit.joint, r.unit.n_total));
    order.into_iter().flat_map(|record| {
        let unit = &record.unit;
        let columns = format!("{},{},{}", unit.repeat + 1, unit.joint, unit.n_total);
        let file = unit.file_name();
        let row = move |model: &ModelRecord| format!("{columns},{}", model.model);
        let models = record.models.iter();
        models.map(move |model| (row(model), model, file.clone()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::curves::tests::{curves as of, record};

    #[test]
    fn every_table_has_as_many_columns_as_its_header() {
        let records = [record(3, 476, [0.25; 5]), record(1, 280, [0.5; 5])];
        let file = records[1].unit.file_name();
        let tables = [
            (
                scores(&records),
                2 * 5 * 2 * 2,
                "1,1,280,sGP,c1,interp,5e-1,",
            ),
            (
                fits(&records),
                2 * 5,
                "1,1,280,sGP,1,0,iGP,gradient-small,7,11,1e-2,dense,40,1e-9,0,,",
            ),
            (seconds(&records), 2 * 5, "1,1,280,sGP,1.500000,0.250000"),
            (
                curves(&of(&records)),
                2 * 4 * 4,
                "1,interp,average,sGP,280,1e0,1e0,1e0",
            ),
        ];
        for (text, n_rows, first) in tables {
            let lines: Vec<&str> = text.lines().collect();
            assert_eq!(lines.len(), n_rows + 1);
            let file = if first.ends_with(',') { &file } else { "" };
            assert_eq!(lines[1], format!("{first}{file}"));
            let commas = |line: &str| line.matches(',').count();
            assert!(
                lines.iter().all(|line| commas(line) == commas(lines[0])),
                "{text}"
            );
        }
    }
}
