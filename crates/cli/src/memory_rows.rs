//! The hysteresis states of rows that are read one after another.

use std::collections::BTreeMap;

use puma_dyn::dynamics::Hysteresis;
use torque_model::is_same_length;

use crate::context::columns_error;
use crate::error::CliError;
use crate::log_columns::LogColumns;
use crate::log_rows::LogRows;
use crate::model_file::ModelFile;
use crate::table::{Row, Table};

/// Follows the friction of a model along the runs of a table.
pub struct MemoryRows {
    log: Option<LogRows>,
    memory: Hysteresis,
    /// For each length of the model, its place among those of the table.
    given: Vec<Option<usize>>,
    n_joints: usize,
    /// Of each context and run, the last time and the states then.
    runs: BTreeMap<(usize, Option<usize>), (f64, Hysteresis)>,
    /// States of the last row.
    z: Vec<f64>,
}

impl MemoryRows {
    /// Of a model's lengths; of a model without memory, nothing is looked for.
    ///
    /// # Errors
    /// A table with neither times nor states, for a model that remembers.
    pub fn new(model: &ModelFile, table: &Table) -> Result<Self, CliError> {
        let (lengths, n_joints) = (model.hysteresis_lengths(), model.n_joints());
        let mut rows = Self {
            log: None,
            memory: model.hysteresis(),
            given: vec![None; lengths.len()],
            n_joints,
            runs: BTreeMap::new(),
            z: Vec::new(),
        };
        if lengths.is_empty() {
            return Ok(rows);
        }
        let file = table.file();
        let mut columns = LogColumns::find(file, &table.column_names(), &model.joints())?;
        columns.used.clear();
        for (length, place) in lengths.iter().zip(&mut rows.given) {
            *place = (columns.hysteresis.iter()).position(|of| is_same_length(of.length, *length));
        }
        if columns.time.is_none() && rows.given.contains(&None) {
            return Err(columns_error(
                file,
                format!(
                    "the friction of {} remembers: a column t (s) is needed, with the rows in their order",
                    model.file
                ),
            ));
        }
        rows.log = Some(LogRows::new(columns));
        Ok(rows)
    }

    /// The states of a row, which moves at q̇ in a context.
    ///
    /// # Errors
    /// Times that do not go on, states out of range.
    pub fn take(&mut self, row: Row<'_>, context: usize, qd: &[f64]) -> Result<&[f64], CliError> {
        let Some(log) = &mut self.log else {
            return Ok(&[]);
        };
        let said = log.take(row)?;
        self.z.clear();
        if let Some(t) = said.t {
            let run = self.runs.entry((context, said.run));
            let (before, memory) = run.or_insert_with(|| (t, self.memory.clone()));
            if t < *before {
                memory.reset(); // a new run without a label
            } else {
                memory.advance(qd, t - *before);
            }
            *before = t;
            self.z.extend_from_slice(memory.states());
        } else {
            self.z.extend_from_slice(self.memory.states());
        }
        let of_lengths = self.z.chunks_exact_mut(self.n_joints);
        for (z, place) in of_lengths.zip(&self.given) {
            if let Some(place) = place {
                z.copy_from_slice(&said.hysteresis[place * self.n_joints..][..self.n_joints]);
            }
        }
        Ok(&self.z)
    }
}
