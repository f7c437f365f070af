//! Measured states and torques, read whole: what a model is learned from or judged by.

use faer::Mat;
use torque_model::{ContinuousJoints, JointTorques, Samples};

use crate::columns::StateColumns;
use crate::context::ContextFilter;
use crate::context_column::ContextColumn;
use crate::degrees::DegreesWatch;
use crate::error::CliError;
use crate::header_joints::{chosen, joints_of, unfinished};
use crate::joints::{Joints, TORQUE_UNIT};
use crate::log_columns::LogColumns;
use crate::log_rows::TimelineRows;
use crate::messages;
use crate::number_column::NumberColumn;
use crate::table::{Row, Table};

/// The joints of a table and the columns to read.
#[derive(Debug)]
pub struct DataColumns {
    /// Joints in the order of x.
    pub joints: Joints,
    /// Where the states are.
    pub states: StateColumns,
    /// Where the torques of some joints are: index of the joint and column, in ascending order.
    torques: Vec<(usize, NumberColumn)>,
    /// What is said of columns that belong to no complete joint, if there are any.
    unfinished: Option<String>,
}

/// Rows of a table.
#[derive(Debug)]
pub struct Data {
    /// States and torques; the rows' contexts only where several count.
    pub samples: Samples,
    /// Name of the one context; empty if the file does not say, or has several that count.
    pub context: String,
    /// What may be wrong with the data.
    doubts: Vec<String>,
}

impl Data {
    /// The same, where all rows are of one context as data of that context.
    pub fn without_only_context(mut self) -> Self {
        if let [only] = self.samples.contexts.as_slice() {
            self.context.clone_from(only);
            self.samples.contexts.clear();
            self.samples.context_of.clear();
        }
        self
    }

    /// Warns of what may be wrong with the data.
    pub fn warn(&self, file: &str) {
        for doubt in &self.doubts {
            messages::warning(format!("{file}: {doubt}"));
        }
    }
}

impl DataColumns {
    /// Finds states by the header alone, and the torques of the joints asked for, or else of all that have any.
    ///
    /// # Errors
    /// Columns that are missing or ambiguous, joints that do not exist.
    pub fn of_header(
        table: &Table,
        tau_prefix: &str,
        option: &str,
        asked: &[String],
    ) -> Result<Self, CliError> {
        let joints = joints_of(table.file(), &table.column_names(), tau_prefix)?;
        let unfinished = unfinished(&table.column_names(), &joints);
        let columns = Self::of_robot(table, joints, tau_prefix, option, asked)?;
        Ok(Self {
            unfinished,
            ..columns
        })
    }

    /// Finds the states of known joints, and the torques of those asked for, or else of all that have any.
    ///
    /// # Errors
    /// Columns that are missing or ambiguous, joints that do not exist.
    pub fn of_robot(
        table: &Table,
        joints: Joints,
        tau_prefix: &str,
        option: &str,
        asked: &[String],
    ) -> Result<Self, CliError> {
        let header = table.column_names();
        let states = StateColumns::find(table.file(), &header, &joints)?;
        let wanted = if asked.is_empty() {
            let torques = states.naming.columns(tau_prefix, &joints.names);
            let present = |joint_idx: &usize| header.contains(&torques[*joint_idx]);
            (0..joints.names.len()).filter(present).collect()
        } else {
            chosen(option, asked, &joints)?
        };
        Self::with_torques(table, joints, states, tau_prefix, &wanted)
    }

    /// Finds the states of known joints, and the torques of some of them.
    ///
    /// # Errors
    /// Columns that are missing or ambiguous.
    pub fn of_joints(
        table: &Table,
        joints: Joints,
        tau_prefix: &str,
        wanted: &[usize],
    ) -> Result<Self, CliError> {
        let states = StateColumns::find(table.file(), &table.column_names(), &joints)?;
        Self::with_torques(table, joints, states, tau_prefix, wanted)
    }

    fn with_torques(
        table: &Table,
        joints: Joints,
        states: StateColumns,
        tau_prefix: &str,
        wanted: &[usize],
    ) -> Result<Self, CliError> {
        let header = table.column_names();
        let names = states.naming.columns(tau_prefix, &joints.names);
        let found = |name: &String| header.iter().position(|column| column == name);
        let torques: Vec<(usize, NumberColumn)> = wanted
            .iter()
            .filter_map(|&joint_idx| {
                let column = NumberColumn {
                    idx: found(&names[joint_idx])?,
                    name: names[joint_idx].clone(),
                    joint: joints.names[joint_idx].clone(),
                    unit: TORQUE_UNIT,
                };
                Some((joint_idx, column))
            })
            .collect();
        if torques.is_empty() || torques.len() < wanted.len() {
            let asked: Vec<String> = if wanted.is_empty() {
                names
            } else {
                wanted.iter().map(|&idx| names[idx].clone()).collect()
            };
            return Err(CliError::MissingColumns {
                file: table.file().to_owned(),
                missing: asked
                    .into_iter()
                    .filter(|name| found(name).is_none())
                    .collect(),
                found: header,
                hint: "Torques are needed in N·m; --tau-prefix says how their columns begin"
                    .to_owned(),
            });
        }
        Ok(Self {
            joints,
            states,
            torques,
            unfinished: None,
        })
    }

    /// The same columns, of which some joints are known to turn without end.
    #[must_use]
    pub fn with_continuous(self, continuous: &ContinuousJoints) -> Self {
        Self {
            joints: self.joints.with_continuous(continuous),
            ..self
        }
    }

    /// Reads all rows of one context.
    ///
    /// # Errors
    /// A field that is not a finite number, rows of several contexts, no row at all.
    pub fn read(&self, table: &mut Table, context: Option<&str>) -> Result<Data, CliError> {
        let mut filter = ContextFilter::new(table.file(), &table.column_names(), context)?;
        let mut data = self.read_rows(table, |row| filter.admits(row))?;
        data.context = filter.finish(data.samples.n_rows())?;
        Ok(data)
    }

    /// Reads all rows, each of one of several contexts.
    ///
    /// # Errors
    /// A field that is not a finite number, a context that is not known, no row at all.
    pub fn read_all(
        &self,
        table: &mut Table,
        mut contexts: ContextColumn,
    ) -> Result<Data, CliError> {
        let mut data = self.read_rows(table, |row| contexts.take(row).map(|_| true))?;
        (data.samples.contexts, data.samples.context_of) = contexts.into_parts();
        Ok(data)
    }

    /// Reads all rows without regard to contexts.
    ///
    /// # Errors
    /// A field that is not a finite number, no row at all.
    pub fn read_as_one(&self, table: &mut Table) -> Result<Data, CliError> {
        self.read_rows(table, |_| Ok(true))
    }

    fn read_rows(
        &self,
        table: &mut Table,
        mut admits: impl FnMut(Row<'_>) -> Result<bool, CliError>,
    ) -> Result<Data, CliError> {
        let (n_covariates, n_joints) = (self.states.states.len(), self.joints.names.len());
        let mut degrees =
            DegreesWatch::without_limits(&self.states.states[..n_joints], &self.joints);
        let log = LogColumns::find(table.file(), &table.column_names(), &self.joints)?;
        let mut timeline = TimelineRows::new(log, n_joints);
        let mut q = vec![0.0; n_joints];
        let mut states = vec![Vec::new(); n_covariates];
        let mut torques = vec![Vec::new(); self.torques.len()];
        while let Some(row) = table.next_row()? {
            if !admits(row)? {
                continue;
            }
            for (values, column) in states.iter_mut().zip(&self.states.states) {
                values.push(row.number(column)?);
            }
            for (q, values) in q.iter_mut().zip(&states) {
                *q = values.last().copied().unwrap_or_default();
            }
            degrees.see(&q);
            for (values, (_, column)) in torques.iter_mut().zip(&self.torques) {
                values.push(row.number(column)?);
            }
            timeline.take(row)?;
        }
        let joint_idxs = self.torques.iter().map(|(joint_idx, _)| *joint_idx);
        let samples = Samples {
            joint_names: self.joints.names.clone(),
            contexts: Vec::new(),
            context_of: Vec::new(),
            x: matrix(states),
            torques: joint_idxs
                .zip(torques)
                .map(|(joint_idx, values)| JointTorques { joint_idx, values })
                .collect(),
            timeline: timeline.into_timeline(),
            continuous: ContinuousJoints::none(),
        };
        let mut doubts = degrees.doubts();
        doubts.extend(self.unfinished.clone());
        Ok(Data {
            samples,
            context: String::new(),
            doubts,
        })
    }
}

/// The matrix of some columns; each is freed as soon as it is copied.
fn matrix(columns: Vec<Vec<f64>>) -> Mat<f64> {
    let n_rows = columns.first().map_or(0, Vec::len);
    let mut x = Mat::with_capacity(n_rows, columns.len());
    for (col, values) in columns.into_iter().enumerate() {
        x.resize_with(n_rows, col + 1, |row, _| values[row]);
    }
    x
}
