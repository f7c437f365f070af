//! What can be wrong with a log.

use std::io;

use thiserror::Error;

/// Why a log cannot be made into samples.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LogError {
    /// Of the file system.
    #[error("cannot read {file}: {source}")]
    Io {
        /// Path.
        file: String,
        /// The system's reason.
        source: io::Error,
    },
    /// Of temporary files.
    #[error("cannot keep the log's columns in a temporary file: {0}")]
    Temporary(#[from] io::Error),
    /// A file that is not the log it is taken for.
    #[error("{file}: {what}")]
    File {
        /// Path.
        file: String,
        /// What and where.
        what: String,
    },
    /// A description of a log's columns that cannot be.
    #[error("{0}")]
    Mapping(String),
    /// Time that runs backwards.
    #[error("time runs backwards at row {row}: {after} s after {before} s")]
    Backwards {
        /// Row of the run, from 1.
        row: usize,
        /// Stamp before, s.
        before: f64,
        /// Stamp, s.
        after: f64,
    },
    /// Stamps that say nothing.
    #[error("all rows have the same time; say --rate HZ if they are evenly spaced")]
    OneMoment,
    /// A cut-off that no filter has.
    #[error(
        "a low-pass of {cut_off} Hz on a log of {rate:.6} Hz: the cut-off must be above 0 and below half the rate"
    )]
    CutOff {
        /// Hz.
        cut_off: f64,
        /// Hz.
        rate: f64,
    },
    /// Too few rows for the filter.
    #[error("{n_rows} rows without a gap; the filter needs {needed}")]
    Short {
        /// Rows there are.
        n_rows: usize,
        /// Rows it takes.
        needed: usize,
    },
    /// Something about one run of a file.
    #[error("{file}: run `{run}`: {cause}")]
    Run {
        /// Path.
        file: String,
        /// Its name.
        run: String,
        /// What.
        cause: Box<LogError>,
    },
}

impl LogError {
    /// A fault of a file.
    pub(crate) fn file(file: impl Into<String>, what: impl Into<String>) -> Self {
        Self::File {
            file: file.into(),
            what: what.into(),
        }
    }
}
