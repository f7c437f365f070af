//! The file format of an output, and how numbers are written.

use std::io::{self, Write};
use std::path::Path;

use clap::ValueEnum;

use crate::error::CliError;

/// File format of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// Comma-separated text with a header
    Csv,
    /// Apache Parquet (needs a build with `--features parquet`)
    Parquet,
}

impl Format {
    /// The format asked for, or the one of the file's extension.
    ///
    /// # Errors
    /// An extension that says nothing, or Parquet in a build without it.
    pub fn of(path: &Path, asked: Option<Self>) -> Result<Self, CliError> {
        let extension = path.extension().and_then(|extension| extension.to_str());
        let format = match (asked, extension) {
            (Some(format), _) => format,
            (None, Some("csv")) => Self::Csv,
            (None, Some("parquet")) => Self::Parquet,
            (None, _) if path == Path::new("-") => Self::Csv,
            (None, _) => {
                let path = path.display();
                let reason = format!(
                    "the format of {path} is not clear: end it in .csv or .parquet, or say --format csv"
                );
                return Err(CliError::Usage(reason));
            }
        };
        format.check_built()
    }

    /// The extension of this format.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
        }
    }

    /// The format itself, unless this build cannot write it.
    ///
    /// # Errors
    /// Parquet in a build without it, with the way to build it.
    pub fn check_built(self) -> Result<Self, CliError> {
        if self == Self::Parquet && !cfg!(feature = "parquet") {
            let reason = "this torque-gp was built without Parquet; write .csv, or rebuild it with \
                          `cargo install --path crates/cli --features parquet`";
            return Err(CliError::Usage(reason.to_owned()));
        }
        Ok(self)
    }
}

/// Writes numbers, each after a comma, with the fewest digits that read back as the same number.
///
/// # Errors
/// A system error of the writer.
pub fn write_numbers(writer: &mut impl Write, numbers: &[f64]) -> io::Result<()> {
    numbers
        .iter()
        .try_for_each(|number| write!(writer, ",{number:?}"))
}
