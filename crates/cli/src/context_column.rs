//! The column `context` of data of several loads: a number for every row's context.

use crate::context::{COLUMN, columns_error, listed};
use crate::error::CliError;
use crate::table::Row;

/// Gives the rows' contexts their numbers.
#[derive(Debug)]
pub struct ContextColumn {
    file: String,
    /// Position of the column.
    column: usize,
    names: Vec<String>,
    /// Who has these contexts, if no others are accepted.
    whose: Option<String>,
    /// Number of the context of every row seen.
    numbers: Vec<usize>,
}

impl ContextColumn {
    /// Contexts that are numbered in the order in which they appear.
    ///
    /// # Errors
    /// A table without such a column.
    pub fn of_any(file: &str, header: &[String]) -> Result<Self, CliError> {
        Self::find(file, header, Vec::new(), None)
    }

    /// The known contexts of a model or file, `whose` name messages say.
    ///
    /// # Errors
    /// A table without such a column.
    pub fn of_known(
        file: &str,
        header: &[String],
        names: &[String],
        whose: &str,
    ) -> Result<Self, CliError> {
        Self::find(file, header, names.to_vec(), Some(whose.to_owned()))
    }

    fn find(
        file: &str,
        header: &[String],
        names: Vec<String>,
        whose: Option<String>,
    ) -> Result<Self, CliError> {
        let Some(column) = header.iter().position(|name| name == COLUMN) else {
            let reason = format!("there is no column `{COLUMN}`, which says each row's context");
            return Err(columns_error(file, reason));
        };
        Ok(Self {
            file: file.to_owned(),
            column,
            names,
            whose,
            numbers: Vec::new(),
        })
    }

    /// Takes a row; returns the number of its context.
    ///
    /// # Errors
    /// An empty entry, or a context that is not one of the known.
    pub fn take(&mut self, row: Row<'_>) -> Result<usize, CliError> {
        let name = row.text(self.column).trim();
        let place = || format!("row {}, column `{COLUMN}`", row.number);
        if name.is_empty() {
            let reason = format!("{}: the field is empty", place());
            return Err(columns_error(&self.file, reason));
        }
        let known = self.names.iter().position(|known| known == name);
        let number = match (known, &self.whose) {
            (Some(number), _) => number,
            (None, None) => {
                self.names.push(name.to_owned());
                self.names.len() - 1
            }
            (None, Some(whose)) => {
                let reason = format!(
                    "{}: `{name}` is not a context of {whose}, which has {}",
                    place(),
                    listed(&self.names)
                );
                return Err(columns_error(&self.file, reason));
            }
        };
        self.numbers.push(number);
        Ok(number)
    }

    /// Names of the contexts in the order of their numbers, and the numbers of the rows' contexts.
    pub fn into_parts(self) -> (Vec<String>, Vec<usize>) {
        (self.names, self.numbers)
    }
}
