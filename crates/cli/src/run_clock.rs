//! Which rows of a table are one run, and the time from each of them to the next.

use crate::context::columns_error;
use crate::error::CliError;
use crate::number_column::NumberColumn;
use crate::table::Row;

/// Name of the column of times.
const TIME: &str = "t";
/// Names of the columns whose change begins a run.
const LABELS: [&str; 2] = ["context", "run"];

/// Reads the time of rows, one after the other.
///
/// A run begins where `context` or `run` changes; in a table without these columns, where time falls.
pub struct RunClock {
    time: NumberColumn,
    labels: Vec<usize>,
    last: Option<(f64, Vec<String>)>,
}

impl RunClock {
    /// The clock of a table with a header; `why` says what needs times.
    ///
    /// # Errors
    /// No column of times.
    pub fn find(file: &str, header: &[String], why: &str) -> Result<Self, CliError> {
        let position = |name: &str| header.iter().position(|column| column == name);
        let Some(idx) = position(TIME) else {
            let reason = format!("there is no column `{TIME}` (s): {why}");
            return Err(columns_error(file, reason));
        };
        Ok(Self {
            time: NumberColumn {
                idx,
                name: TIME.to_owned(),
                joint: "time".to_owned(),
                unit: "s",
            },
            labels: LABELS.iter().filter_map(|name| position(name)).collect(),
            last: None,
        })
    }

    /// Time since the row before, s; `None` for the first row of a run.
    ///
    /// # Errors
    /// A time that is not a number, or does not come after that of the row before in the same run.
    pub fn elapsed(&mut self, row: Row<'_>) -> Result<Option<f64>, CliError> {
        let time = row.number(&self.time)?;
        let labels = self.labels.iter().map(|idx| row.text(*idx));
        let is_same = |last: &[String]| last.iter().map(String::as_str).eq(labels.clone());
        let before = match &self.last {
            Some((before, last)) if is_same(last) => Some(*before),
            _ => None,
        };
        if let Some(before) = before {
            let falls = time < before && !self.labels.is_empty();
            if falls || (time - before).abs() <= 0.0 {
                let problem = format!("{time} s does not come after {before} s, the row before");
                return Err(row.refused(&self.time, problem));
            }
        }
        match &mut self.last {
            Some((last, _)) if before.is_some() => *last = time,
            last => *last = Some((time, labels.map(str::to_owned).collect())),
        }
        Ok(before
            .map(|before| time - before)
            .filter(|step| *step > 0.0))
    }
}
