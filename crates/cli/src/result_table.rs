//! The rows of a result: columns copied from the input, then new columns of numbers.

use std::borrow::Cow;
use std::io::{self, Write};

use crate::columns::StateColumns;
use crate::error::CliError;
use crate::output::Output;
use crate::table::{Row, Table};

/// Which columns are copied, and the header of the result.
pub struct ResultTable {
    /// Positions in the input.
    copied: Vec<usize>,
    header: Vec<String>,
}

impl ResultTable {
    /// A result with the input's extra columns, or with all of them, before the `added` ones.
    ///
    /// # Errors
    /// An input that already has one of the result's columns.
    pub fn new(
        table: &Table,
        columns: &StateColumns,
        keep_states: bool,
        added: Vec<String>,
    ) -> Result<Self, CliError> {
        let names = table.column_names();
        let copied = if keep_states {
            (0..names.len()).collect()
        } else {
            columns.extra.clone()
        };
        let mut header: Vec<String> = copied.iter().map(|&idx| names[idx].clone()).collect();
        check_names(table.file(), &header, &added)?;
        header.extend(added);
        Ok(Self { copied, header })
    }

    /// Writes the line of column names.
    ///
    /// # Errors
    /// A system error.
    pub fn write_header(&self, output: &mut Output) -> Result<(), CliError> {
        let names: Vec<_> = self.header.iter().map(|name| quoted(name)).collect();
        let line = names.join(",");
        writeln!(output, "{line}").map_err(CliError::io("write", output.name()))
    }

    /// The fields of a row that are copied.
    pub fn copied_fields<'a>(&'a self, row: Row<'a>) -> impl Iterator<Item = &'a str> {
        self.copied.iter().map(move |&idx| row.text(idx))
    }
}

/// Writes one row, its numbers with the fewest digits that read back as the same number.
///
/// # Errors
/// A system error.
pub fn write_row<'a>(
    copied: impl Iterator<Item = &'a str>,
    numbers: impl Iterator<Item = &'a f64>,
    output: &mut Output,
) -> io::Result<()> {
    let mut separator = "";
    for text in copied {
        write!(output, "{separator}{}", quoted(text))?;
        separator = ",";
    }
    for number in numbers {
        write!(output, "{separator}{number:?}")?;
        separator = ",";
    }
    writeln!(output)
}

/// Refuses an input that already has one of the result's columns.
fn check_names(file: &str, copied: &[String], added: &[String]) -> Result<(), CliError> {
    let twice: Vec<&str> = added
        .iter()
        .filter(|name| copied.contains(name))
        .map(String::as_str)
        .collect();
    if twice.is_empty() {
        return Ok(());
    }
    let reason = format!(
        "already has the result's columns {}; give the result other names with --tau-prefix, such as --tau-prefix model_tau",
        twice.join(", "),
    );
    Err(CliError::Columns {
        file: file.to_owned(),
        reason,
    })
}

/// A field as CSV: in quotes if it holds a comma, a quote or a line end.
fn quoted(text: &str) -> Cow<'_, str> {
    if text.contains([',', '"', '\n', '\r']) {
        return Cow::Owned(format!("\"{}\"", text.replace('"', "\"\"")));
    }
    Cow::Borrowed(text)
}
