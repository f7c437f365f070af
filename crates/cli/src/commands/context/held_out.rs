//! Held-out torques of known contexts: what p-values are ranks among.

use std::path::Path;

use mtgp::context::Calibration;
use torque_model::{Samples, TorqueError};

use crate::commands::context::evidence::evidence_of;
use crate::context::columns_error;
use crate::context_column::ContextColumn;
use crate::error::CliError;
use crate::model_file::ModelFile;
use crate::samples::DataColumns;
use crate::table::Table;

/// How trials are cut from held-out rows, and judged: as the data are.
pub struct Trials<'a> {
    pub model: &'a ModelFile,
    pub tau_prefix: &'a str,
    /// Standard deviation of noise beyond that of the training data, N·m.
    pub noise: f64,
    /// Rows of the data.
    pub n_rows: usize,
    /// Rows that the total takes.
    pub n_in_total: usize,
    /// The level that p-values are compared with.
    pub level: f64,
}

impl Trials<'_> {
    /// Scores of all trials of a file, each under its own context.
    ///
    /// A trial is as many rows in a row of one context as the data have.
    /// # Errors
    /// As for data with contexts; too few trials for a p-value to be below the level.
    pub fn calibration(&self, path: &Path) -> Result<Calibration, CliError> {
        let mut table = Table::open(path)?;
        let file = table.file().to_owned();
        let header = table.column_names();
        let model = self.model;
        let contexts = ContextColumn::of_known(&file, &header, model.contexts(), &model.file)?;
        let (joints, learned) = (model.joints(), model.learned_joints());
        let columns = DataColumns::of_joints(&table, joints, self.tau_prefix, &learned)?;
        let data = columns.read_all(&mut table, contexts)?;
        let scores = self
            .scores(&data.samples)
            .map_err(CliError::of_data(&file))?;
        let smallest = 1.0 / (scores.len() + 1) as f64;
        if smallest >= self.level {
            let reason = format!(
                "{} trials of {} rows of one context: their smallest p-value is {smallest:.3}, not below --level {}",
                scores.len(),
                self.n_rows,
                self.level
            );
            return Err(columns_error(&file, reason));
        }
        Calibration::new(scores).map_err(CliError::of_data(&file))
    }

    fn scores(&self, samples: &Samples) -> Result<Vec<f64>, TorqueError> {
        let mut scores = Vec::new();
        let mut first = 0;
        for run in samples.context_of.chunk_by(|a, b| a == b) {
            for trial in run.chunks_exact(self.n_rows) {
                let rows: Vec<usize> = (first..first + self.n_rows).collect();
                let of_trial = samples.rows(&rows).spread(self.n_in_total);
                let evidence = evidence_of(self.model, &of_trial, self.noise)?;
                scores.push(evidence.scores()[trial[0]]);
                first += self.n_rows;
            }
            first += run.len() % self.n_rows;
        }
        Ok(scores)
    }
}
