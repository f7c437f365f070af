//! Files of text: their contents, and where in them a TOML parser found fault.

use std::path::Path;

use crate::error::DynError;

/// The text of a file, or an error with its name.
pub(crate) fn read(path: &Path) -> Result<String, DynError> {
    std::fs::read_to_string(path).map_err(|error| DynError::Unreadable {
        file: path.display().to_string(),
        reason: error.to_string(),
    })
}

/// Line and column, from 1, of what the error speaks of.
pub(crate) fn line_and_column(text: &str, error: &toml::de::Error) -> (usize, usize) {
    let at = error.span().map_or(0, |span| span.start).min(text.len());
    let before = &text[..at];
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    (line, column)
}
