//! What a log says of its rows, one row at a time, with the checks that need the rows before.

use std::collections::BTreeMap;

use torque_model::{HysteresisColumns, Timeline};

use crate::error::CliError;
use crate::log_columns::LogColumns;
use crate::number_column::NumberColumn;
use crate::numbered_names::NumberedNames;
use crate::table::Row;

/// How far beyond ±1 a hysteresis state may be by rounding.
const ROUNDING: f64 = 1e-9;

/// Reads the optional columns of a log row after row.
#[derive(Debug)]
pub struct LogRows {
    columns: LogColumns,
    runs: NumberedNames,
    contexts: NumberedNames,
    /// Time of the last row of each context and run.
    last: BTreeMap<(usize, usize), f64>,
    hysteresis: Vec<f64>,
    used: Vec<bool>,
}

/// What a log says of one row; nothing where it has no such column.
#[derive(Debug, Clone, Copy)]
pub struct LogRow<'a> {
    /// Time, s.
    pub t: Option<f64>,
    /// Number of the run's label; [`LogRows::run_name`] is the label.
    pub run: Option<usize>,
    /// Hysteresis states within −1 and 1: those of all joints of the first length, then of the next.
    pub hysteresis: &'a [f64],
    /// Whether the row counts for each joint.
    pub used: &'a [bool],
}

impl LogRows {
    /// Nothing read yet.
    pub fn new(columns: LogColumns) -> Self {
        Self {
            columns,
            runs: NumberedNames::default(),
            contexts: NumberedNames::default(),
            last: BTreeMap::new(),
            hysteresis: Vec::new(),
            used: Vec::new(),
        }
    }

    /// Takes a row.
    ///
    /// Time must rise from row to row of one context and run; without labels of runs it may also fall, which begins
    /// a new run, but not stand still.
    /// # Errors
    /// Fields that are empty or no finite number, hysteresis states beyond ±1, marks that are neither 0 nor 1, and
    /// times that do not go on.
    pub fn take(&mut self, row: Row<'_>) -> Result<LogRow<'_>, CliError> {
        let run = self.run_of(row)?;
        let time = self.columns.time.as_ref();
        let t = time.map(|column| row.number(column)).transpose()?;
        if let Some(t) = t {
            self.check_time(row, run, t)?;
        }
        self.hysteresis.clear();
        for column in (self.columns.hysteresis.iter()).flat_map(|length| &length.columns) {
            self.hysteresis.push(state(row, column)?);
        }
        self.used.clear();
        for column in &self.columns.used {
            self.used.push(mark(row, column)?);
        }
        Ok(LogRow {
            t,
            run,
            hysteresis: &self.hysteresis,
            used: &self.used,
        })
    }

    /// The label of a run.
    ///
    /// # Panics
    /// If no row has had this number.
    pub fn run_name(&self, run: usize) -> &str {
        self.runs.name(run)
    }

    fn run_of(&mut self, row: Row<'_>) -> Result<Option<usize>, CliError> {
        let Some(column) = self.columns.run else {
            return Ok(None);
        };
        let label = row.text(column).trim();
        if label.is_empty() {
            let reason = format!("{}, column `run`: the field is empty", row.place());
            return Err(crate::context::columns_error(&self.columns.file, reason));
        }
        Ok(Some(self.runs.number_of(label)))
    }

    fn check_time(&mut self, row: Row<'_>, run: Option<usize>, t: f64) -> Result<(), CliError> {
        let context = self.columns.context.map_or("", |idx| row.text(idx).trim());
        let key = (self.contexts.number_of(context), run.unwrap_or_default());
        let Some(before) = self.last.insert(key, t) else {
            return Ok(());
        };
        let Some(column) = self.columns.time.as_ref().filter(|_| t <= before) else {
            return Ok(());
        };
        if run.is_none() && t < before {
            return Ok(()); // a new run
        }
        let context = match context {
            "" => String::new(),
            context => format!(" of context `{context}`"),
        };
        let whose = match run {
            Some(run) => format!("run `{}`{context}: ", self.run_name(run)),
            None if context.is_empty() => String::new(),
            None => format!("rows{context}: "),
        };
        Err(row.refused(
            column,
            format!("{whose}time {t} s does not come after {before} s"),
        ))
    }
}

/// A hysteresis state; one that is beyond ±1 by rounding is ±1.
fn state(row: Row<'_>, column: &NumberColumn) -> Result<f64, CliError> {
    let z = row.number(column)?;
    if z.abs() > 1.0 + ROUNDING {
        return Err(row.refused(column, format!("{z} is not within −1 and 1")));
    }
    Ok(z.clamp(-1.0, 1.0))
}

/// Whether a row counts.
fn mark(row: Row<'_>, column: &NumberColumn) -> Result<bool, CliError> {
    let text = row.text(column.idx).trim();
    match row.number(column)? {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(row.refused(column, format!("`{text}` is neither 0 nor 1"))),
    }
}

/// Collects what a log says of all rows.
#[derive(Debug)]
pub struct TimelineRows {
    rows: LogRows,
    n_joints: usize,
    timeline: Timeline,
}

impl TimelineRows {
    /// Nothing read yet, of a robot with so many joints.
    pub fn new(columns: LogColumns, n_joints: usize) -> Self {
        let of_length = |length: f64| HysteresisColumns {
            length,
            z: Vec::new(),
        };
        let lengths = columns.hysteresis.iter().map(|of| of_length(of.length));
        let timeline = Timeline {
            hysteresis: lengths.collect(),
            ..Timeline::default()
        };
        Self {
            rows: LogRows::new(columns),
            n_joints,
            timeline,
        }
    }

    /// Takes a row.
    ///
    /// # Errors
    /// As for [`LogRows::take`].
    pub fn take(&mut self, row: Row<'_>) -> Result<(), CliError> {
        let said = self.rows.take(row)?;
        let timeline = &mut self.timeline;
        timeline.run_of.extend(said.run);
        timeline.t.extend(said.t);
        timeline.used.extend_from_slice(said.used);
        let of_lengths = said.hysteresis.chunks(self.n_joints);
        for (of_length, z) in timeline.hysteresis.iter_mut().zip(of_lengths) {
            of_length.z.extend_from_slice(z);
        }
        Ok(())
    }

    /// All that was said.
    pub fn into_timeline(self) -> Timeline {
        Timeline {
            run_names: self.rows.runs.into_names(),
            ..self.timeline
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::DataColumns;
    use crate::table::Table;

    #[test]
    fn a_log_is_read_under_its_names() {
        let text = "use_2,z2_1,run,z0.5_2,t,q1,q2,qd1,qd2,qdd1,qdd2,tau2,z0.5_1,use_1,z2_2\n\
                    1, 0.25,b ,-1.0000000001,0.5,1,2,3,4,5,6,7,0.5,0,1\n\
                    0,0,a,0,0.25,8,9,10,11,12,13,14,-0.5,1,-1\n";
        let mut table = Table::from_bytes("log.csv".to_owned(), text.into()).unwrap();
        let columns = DataColumns::of_header(&table, "tau", "--joints", &[]).unwrap();
        let samples = columns.read(&mut table, None).unwrap().samples;
        let of_length = |length, z: [f64; 4]| HysteresisColumns {
            length,
            z: z.to_vec(),
        };
        let expected = Timeline {
            run_of: vec![0, 1],
            run_names: vec!["b".to_owned(), "a".to_owned()],
            t: vec![0.5, 0.25],
            hysteresis: vec![
                of_length(0.5e-3, [0.5, -1.0, -0.5, 0.0]),
                of_length(2e-3, [0.25, 1.0, 0.0, -1.0]),
            ],
            used: vec![false, true, true, false],
        };
        assert_eq!(samples.timeline, expected);
        let x: Vec<f64> = (samples.x.row_iter())
            .flat_map(|row| row.iter().copied().collect::<Vec<_>>())
            .collect();
        assert_eq!(x, [1., 2., 3., 4., 5., 6., 8., 9., 10., 11., 12., 13.]);
        assert_eq!(samples.torques[0].values, [7.0, 14.0]);
    }
}
