//! The one error type of the program: every message names the file and, where there is one, row, column, joint and unit.

use std::io;

use puma_dyn::DynError;
use thiserror::Error;
use torque_model::{ModelFileError, TorqueError};

use crate::number_column::NumberColumn;

/// Why a command stops. All of these are bad input or usage: exit status 2.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CliError {
    /// A robot's log that cannot be made into samples.
    #[error(transparent)]
    Log(#[from] robot_log::LogError),
    /// A file cannot be opened, read or written.
    #[error("cannot {action} {file}: {source}")]
    Io {
        /// `read`, `write`, …
        action: &'static str,
        /// Path, or `standard output`.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// A table without a header.
    #[error(
        "{file}: the file is empty; a header line with column names is needed, then one row per sample"
    )]
    Empty {
        /// Path.
        file: String,
    },
    /// A table that starts with numbers.
    #[error(
        "{file}: line 1 holds numbers, not column names; a header such as q1,q2,…,qd1,…,qdd1,… is needed"
    )]
    NoHeader {
        /// Path.
        file: String,
    },
    /// A table whose columns are separated by blanks.
    #[error(
        "{file}: line 1 has no comma: separate the columns by commas, not blanks, under a header such as q1,q2,…,qd1,…,qdd1,…; \
         `torque-gp prepare` reads logs of any separator, with a header or without"
    )]
    Blanks {
        /// Path.
        file: String,
    },
    /// A header and nothing below it.
    #[error("{file}: there is a header but no row below it")]
    NoRows {
        /// Path.
        file: String,
    },
    /// Two columns of one name.
    #[error("{file}: column `{column}` appears twice, as column {first} and column {second}")]
    DuplicateColumn {
        /// Path.
        file: String,
        /// Name.
        column: String,
        /// 1-based position.
        first: usize,
        /// 1-based position.
        second: usize,
    },
    /// Not all states are there.
    #[error("{file}: missing column{}: {}; found: {}. {hint}", plural(.missing), .missing.join(", "), listed(.found))]
    MissingColumns {
        /// Path.
        file: String,
        /// The missing columns, in joint order.
        missing: Vec<String>,
        /// The whole header.
        found: Vec<String>,
        /// What the robot needs.
        hint: String,
    },
    /// The columns do not fit the robot.
    #[error("{file}: {reason}")]
    Columns {
        /// Path.
        file: String,
        /// Which columns and why.
        reason: String,
    },
    /// A row with too few or too many fields.
    #[error("{file}: row {row} (line {line}) has {found} fields, the header has {expected}")]
    RowLength {
        /// Path.
        file: String,
        /// 1-based data row.
        row: u64,
        /// 1-based line of the file.
        line: u64,
        /// Fields of the row.
        found: usize,
        /// Fields of the header.
        expected: usize,
    },
    /// A field that is not a finite number.
    #[error(
        "{file}: row {row} (line {line}), column `{}` ({}, {}): {problem}",
        column.name, column.joint, column.unit
    )]
    Field {
        /// Path.
        file: String,
        /// 1-based data row.
        row: u64,
        /// 1-based line of the file.
        line: u64,
        /// Name, joint and unit.
        column: Box<NumberColumn>,
        /// What is wrong with the text.
        problem: String,
    },
    /// A table that is not text.
    #[error("{file}: line {line}: the text is not UTF-8")]
    NotText {
        /// Path.
        file: String,
        /// 1-based line of the file.
        line: u64,
    },
    /// A payload file that says something impossible.
    #[error("{file}: {reason}")]
    Payload {
        /// Path.
        file: String,
        /// Which key and why.
        reason: String,
    },
    /// A hyperparameter file that says something impossible.
    #[error("{file}: {reason}")]
    Hyperparameters {
        /// Path.
        file: String,
        /// Which key and why.
        reason: String,
    },
    /// A file that is no model, or not a whole one.
    #[error("{file}: {cause}")]
    ModelFile {
        /// Path.
        file: String,
        /// What is wrong with it.
        #[source]
        cause: ModelFileError,
    },
    /// Data from which nothing can be learned or predicted.
    #[error("{file}: joint `{joint}`: {cause}")]
    Joint {
        /// Path of the data.
        file: String,
        /// Name of the joint.
        joint: String,
        /// Why.
        #[source]
        cause: Box<TorqueError>,
    },
    /// Data that a library refuses.
    #[error("{file}: {cause}")]
    Data {
        /// Path of the data.
        file: String,
        /// Why.
        #[source]
        cause: Box<TorqueError>,
    },
    /// A model that has no torque for what is desired of the robot.
    #[error("{stop}: {file}: {what}")]
    FeedForward {
        /// Path of the model.
        file: String,
        /// What the model says, with the joint's name.
        what: String,
        /// What stopped the simulation.
        stop: Box<DynError>,
        /// What the model says.
        #[source]
        cause: Box<TorqueError>,
    },
    /// Options that do not fit together, or a path that cannot be used.
    #[error("{0}")]
    Usage(String),
    /// A robot or scenario that is refused.
    #[error("{0}")]
    Robot(#[from] DynError),
    /// A scenario file that is refused.
    #[error("{file}: {cause}")]
    Scenario {
        /// Path.
        file: String,
        /// Why.
        #[source]
        cause: Box<DynError>,
    },
}

impl CliError {
    /// Turns a system error into one that names the file, for `map_err`.
    pub fn io(action: &'static str, file: impl Into<String>) -> impl FnOnce(io::Error) -> Self {
        let file = file.into();
        move |source| Self::Io {
            action,
            file,
            source,
        }
    }

    /// Turns a library's error into one that names the file of the data, for `map_err`.
    pub fn of_data<E: Into<TorqueError>>(file: &str) -> impl Fn(E) -> Self {
        move |cause| match cause.into() {
            TorqueError::Joint { joint, cause } => Self::Joint {
                file: file.to_owned(),
                joint,
                cause,
            },
            cause => Self::Data {
                file: file.to_owned(),
                cause: Box::new(cause),
            },
        }
    }
}

/// Names of columns, of which a message has room for so many, of so many characters each.
fn listed(names: &[String]) -> String {
    const MOST: usize = 60;
    const LONGEST: usize = 60;
    let shown = names.iter().take(MOST).map(|name| {
        let mut letters = name.chars();
        let start: String = letters.by_ref().take(LONGEST).collect();
        let end = if letters.next().is_some() { "…" } else { "" };
        format!("{}{end}", start.escape_debug())
    });
    let shown = shown.collect::<Vec<_>>().join(", ");
    match names.len().saturating_sub(MOST) {
        0 => shown,
        rest => format!("{shown}, … and {rest} more"),
    }
}

fn plural(names: &[String]) -> &'static str {
    if names.len() == 1 { "" } else { "s" }
}
