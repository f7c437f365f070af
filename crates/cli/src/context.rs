//! Rows of one context: a model is for one load, so data of several must be told apart.

use std::collections::BTreeSet;

use crate::error::CliError;
use crate::table::Row;

/// Name of the column that says under which load a row was measured.
pub const COLUMN: &str = "context";

/// How many contexts a message lists.
const LISTED: usize = 12;

/// Lets the rows of one context through.
pub struct ContextFilter {
    file: String,
    /// Position of the column, if there is one.
    column: Option<usize>,
    wanted: Option<String>,
    /// Names met; only the first few more than are listed.
    seen: BTreeSet<String>,
}

impl ContextFilter {
    /// A filter for the context asked for, or for the only one of the file.
    ///
    /// # Errors
    /// A context asked for of a file without such a column.
    pub fn new(file: &str, header: &[String], wanted: Option<&str>) -> Result<Self, CliError> {
        let column = header.iter().position(|name| name == COLUMN);
        if let (Some(wanted), None) = (wanted, column) {
            let reason = format!("--context {wanted}: there is no column `{COLUMN}`");
            return Err(columns_error(file, reason));
        }
        Ok(Self {
            file: file.to_owned(),
            column,
            wanted: wanted.map(str::to_owned),
            seen: BTreeSet::new(),
        })
    }

    /// Whether a row belongs to the context.
    ///
    /// # Errors
    /// A second context where none was asked for.
    pub fn admits(&mut self, row: Row<'_>) -> Result<bool, CliError> {
        let Some(column) = self.column else {
            return Ok(true);
        };
        let context = row.text(column).trim();
        if !self.seen.contains(context) && self.seen.len() <= LISTED {
            self.seen.insert(context.to_owned());
        }
        match &self.wanted {
            Some(wanted) => Ok(wanted == context),
            None if self.seen.len() == 1 => Ok(true),
            None => Err(columns_error(&self.file, self.several(row.number))),
        }
    }

    /// The context of the rows let through; empty if the file does not say.
    ///
    /// # Errors
    /// Not one row of the context asked for.
    pub fn finish(self, n_admitted: usize) -> Result<String, CliError> {
        match &self.wanted {
            Some(wanted) if n_admitted == 0 => {
                let reason = format!(
                    "--context {wanted}: no row has it in column `{COLUMN}`; there are {}",
                    self.listed()
                );
                Err(columns_error(&self.file, reason))
            }
            Some(wanted) => Ok(wanted.clone()),
            None => Ok(self.seen.into_iter().next().unwrap_or_default()),
        }
    }

    fn several(&self, row: u64) -> String {
        format!(
            "row {row}, column `{COLUMN}`: a second context ({}); a model is for one: choose with --context NAME",
            self.listed()
        )
    }

    fn listed(&self) -> String {
        listed(&self.seen)
    }
}

/// The first few names, for a message.
pub fn listed<'a>(names: impl IntoIterator<Item = &'a String>) -> String {
    let mut names = names.into_iter();
    let first: Vec<String> = names
        .by_ref()
        .take(LISTED)
        .map(|name| format!("`{name}`"))
        .collect();
    let more = if names.next().is_some() { ", …" } else { "" };
    format!("{}{more}", first.join(", "))
}

/// Columns that do not serve.
pub fn columns_error(file: &str, reason: String) -> CliError {
    CliError::Columns {
        file: file.to_owned(),
        reason,
    }
}
