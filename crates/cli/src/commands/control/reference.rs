//! The motion to follow, from a table.

use std::path::Path;

use puma_dyn::Model;
use puma_dyn::motion::ReferenceMotion;

use crate::columns::{Naming, StateColumns};
use crate::context::columns_error;
use crate::degrees::DegreesWatch;
use crate::error::CliError;
use crate::joints::Joints;
use crate::messages;
use crate::number_column::NumberColumn;
use crate::table::Table;

/// Name of the column of times.
const TIME: &str = "t";
/// Seconds that no motion lasts.
const LONGEST: f64 = 86_400.0;
/// Seconds between rows that no motion of an arm is given in.
const SPARSE: f64 = 1.0;

/// A motion and where it is from.
pub struct Reference {
    /// The motion.
    pub motion: ReferenceMotion,
    /// How the table names joints.
    pub naming: Naming,
    /// Name of the table.
    pub file: String,
    /// Its state columns.
    pub columns: Vec<NumberColumn>,
    /// States, (n, 3ℓ) row after row.
    pub states: Vec<f64>,
}

impl Reference {
    /// Reads a table of times and states.
    ///
    /// # Errors
    /// Missing columns, fields that are not finite numbers, fewer than two rows, times that do not ascend, a motion
    /// of more than a day.
    pub fn read(path: &Path, model: &Model) -> Result<Self, CliError> {
        let mut table = Table::open(path)?;
        let (file, header) = (table.file().to_owned(), table.column_names());
        let columns = StateColumns::find(&file, &header, &Joints::of_robot(model))?;
        let Some(idx) = header.iter().position(|name| name == TIME) else {
            let reason = format!("there is no column `{TIME}`: times in s are needed");
            return Err(columns_error(&file, reason));
        };
        let time_column = NumberColumn {
            idx,
            name: TIME.to_owned(),
            joint: "time".to_owned(),
            unit: "s",
        };
        let n = model.n_joints();
        let mut degrees = DegreesWatch::new(model, &columns.states[..n]);
        let (mut time, mut states) = (Vec::new(), Vec::new());
        while let Some(row) = table.next_row()? {
            time.push(row.number(&time_column)?);
            let first = states.len();
            for column in &columns.states {
                states.push(row.number(column)?);
            }
            degrees.see(&states[first..first + n]);
        }
        degrees.doubts().into_iter().for_each(messages::warning);
        check_times(&file, &time)?;
        let motion =
            ReferenceMotion::new(n, time, states.clone()).map_err(CliError::of_data(&file))?;
        Ok(Self {
            motion,
            naming: columns.naming,
            file,
            columns: columns.states,
            states,
        })
    }

    /// The first state's positions.
    pub fn first_q(&self) -> &[f64] {
        &self.states[..self.motion.n_joints()]
    }
}

/// Refuses times that cannot be seconds, and warns of those that hardly are.
fn check_times(file: &str, time: &[f64]) -> Result<(), CliError> {
    let (Some(first), Some(last)) = (time.first(), time.last()) else {
        return Ok(());
    };
    let length = last - first;
    if length > LONGEST {
        let reason = format!(
            "column `{TIME}`: the motion would last {length:.3e} s ({:.1} days); times are in s, not ms or ns",
            length / LONGEST
        );
        return Err(columns_error(file, reason));
    }
    let step = length / (time.len().max(2) - 1) as f64;
    if step > SPARSE {
        messages::warning(format!(
            "{file}: column `{TIME}`: rows are {step} s apart and the motion lasts {length} s; times are in s, not ms"
        ));
    }
    Ok(())
}
