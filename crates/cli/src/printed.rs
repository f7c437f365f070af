//! Results on standard output: a table for people or JSON.

use std::io::Write;
use std::path::Path;

use serde::Serialize;

use crate::error::CliError;
use crate::output::Output;

/// How a result is written.
#[derive(clap::Args, Debug)]
pub struct PrintArgs {
    /// Write JSON, with numbers in full
    #[arg(long)]
    json: bool,
}

impl PrintArgs {
    /// Writes a result as JSON, or the text that says it.
    ///
    /// # Errors
    /// A system error.
    pub fn print<T: Serialize>(
        &self,
        result: &T,
        text: impl FnOnce(&T) -> String,
    ) -> Result<(), CliError> {
        let text = if self.json {
            json(result)?
        } else {
            text(result)
        };
        let mut output = Output::create(Path::new("-"))?;
        output
            .write_all(text.as_bytes())
            .map_err(CliError::io("write", "standard output"))?;
        output.commit()
    }
}

/// A value as indented JSON with a line end; floats have the fewest digits that read back exactly.
fn json(value: &impl Serialize) -> Result<String, CliError> {
    let text = serde_json::to_string_pretty(value)
        .map_err(std::io::Error::other)
        .map_err(CliError::io("write", "JSON"))?;
    Ok(text + "\n")
}
