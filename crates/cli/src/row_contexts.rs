//! The context in which each row of states is predicted.

use crate::context::{columns_error, listed};
use crate::context_column::ContextColumn;
use crate::error::CliError;
use crate::model_file::ModelFile;
use crate::table::{Row, Table};

/// Where a row's context is known from.
pub enum RowContexts {
    /// All rows have the context of this number, of a model of one context zero.
    Same(usize),
    /// The column `context` says it.
    Column(ContextColumn),
}

impl RowContexts {
    /// The context asked for, or the column's.
    ///
    /// # Errors
    /// A context asked for that the model does not have, or of a model of one; neither a context asked for nor a
    /// column, for a model of several.
    pub fn new(model: &ModelFile, table: &Table, asked: Option<&str>) -> Result<Self, CliError> {
        let whose = &model.file;
        let contexts = match (model.contexts(), asked) {
            ([], None) => return Ok(Self::Same(0)),
            ([], Some(asked)) => {
                return Err(of_one_context(whose, &model.provenance().context, asked));
            }
            (contexts, _) => contexts,
        };
        if let Some(asked) = asked {
            return Ok(Self::Same(number_of(asked, contexts, whose)?));
        }
        let (file, header) = (table.file(), table.column_names());
        match ContextColumn::of_known(file, &header, contexts, whose) {
            Ok(column) => Ok(Self::Column(column)),
            Err(_) if contexts.len() == 1 => Ok(Self::Same(0)),
            Err(_) => Err(columns_error(
                file,
                format!(
                    "there is no column `context`; choose one of {whose} for all rows with --context NAME: {}",
                    listed(contexts)
                ),
            )),
        }
    }

    /// The number of a row's context.
    ///
    /// # Errors
    /// An entry of the column that is not a context of the model.
    pub fn take(&mut self, row: Row<'_>) -> Result<usize, CliError> {
        match self {
            Self::Same(number) => Ok(*number),
            Self::Column(column) => column.take(row),
        }
    }
}

/// The number of a context asked for with `--context`.
///
/// # Errors
/// A context that is not there, with those that are.
pub fn number_of(asked: &str, contexts: &[String], whose: &str) -> Result<usize, CliError> {
    number_in("--context", asked, contexts, whose)
}

/// The number of a context asked for with an option.
///
/// # Errors
/// A context that is not there, with those that are.
pub fn number_in(
    option: &str,
    asked: &str,
    contexts: &[String],
    whose: &str,
) -> Result<usize, CliError> {
    let found = contexts.iter().position(|name| name == asked);
    found.ok_or_else(|| {
        CliError::Usage(format!(
            "{option} {asked}: {whose} does not have it; it has {}",
            listed(contexts)
        ))
    })
}

fn of_one_context(whose: &str, context: &str, asked: &str) -> CliError {
    let which = match context {
        "" => String::new(),
        name => format!(", `{name}`"),
    };
    CliError::Usage(format!(
        "--context {asked}: {whose} is a model of one context{which}; leave --context out"
    ))
}
