//! What is said of rows that are close in time, and which of them a process learns from.

use std::borrow::Cow;

use torque_model::rigid_body::LEAST_SECONDS;
use torque_model::{ProcessRows, Samples};

use crate::error::CliError;
use crate::messages;

/// What to do about rows without times.
const COLUMNS: &str =
    "add a column `t` with the rows' times in seconds, and `run` with a label for each motion";

/// The rows that a process is learned from, with a word on those that are not.
///
/// # Errors
/// Time that does not rise within a run.
pub fn of_process<'a>(file: &str, samples: &'a Samples) -> Result<Cow<'a, Samples>, CliError> {
    let rows = samples.process_rows().map_err(CliError::of_data(file))?;
    let n_rows = samples.n_rows();
    match rows {
        ProcessRows::All => {
            warn_without_times(file, samples);
            Ok(Cow::Borrowed(samples))
        }
        ProcessRows::Apart(rows) => {
            let n_used = rows.len();
            messages::note(format!(
                "{file}: {n_used} of {n_rows} rows are learned from, {LEAST_SECONDS} s apart or more in each run: closer ones \
                 share what is not modelled; --all-rows takes all"
            ));
            Ok(Cow::Owned(samples.rows(&rows)))
        }
        ProcessRows::TooFewApart { found, needed } => {
            messages::warning(format!(
                "{file}: {found} of {n_rows} rows are {LEAST_SECONDS} s apart or more, and it takes {needed} to learn from \
                 them alone: all are taken for independent, and where noise is alike from row to row the intervals are \
                 too narrow; longer motions help"
            ));
            Ok(Cow::Borrowed(samples))
        }
    }
}

/// Says how rows count that are close in time, for a model of weighted rows.
///
/// # Errors
/// Time that does not rise within a run.
pub fn tell_of_weights(file: &str, samples: &Samples, model: &str) -> Result<(), CliError> {
    let rows = samples.rows_per_independent(LEAST_SECONDS);
    if rows.map_err(CliError::of_data(file))? > 1.0 {
        messages::note(format!(
            "{file}: rows are closer than {LEAST_SECONDS} s: they count by the correlation of what {model} leaves of the \
             torques in each run; --all-rows takes them for independent"
        ));
    }
    warn_without_times(file, samples);
    Ok(())
}

/// Says how rows of a new context count that are close in time.
///
/// # Errors
/// Time that does not rise within a run.
pub fn tell_of_new_rows(file: &str, samples: &Samples) -> Result<(), CliError> {
    let rows = samples.rows_per_independent(LEAST_SECONDS);
    let rows = rows.map_err(CliError::of_data(file))?;
    if rows > 1.0 {
        let independent = samples.n_rows() as f64 / rows;
        messages::note(format!(
            "{file}: rows are closer than {LEAST_SECONDS} s: {} of them count as {independent:.1}",
            samples.n_rows()
        ));
    }
    warn_without_times(file, samples);
    Ok(())
}

/// Warns of rows that follow each other in time, as their positions and speeds say, where no column does.
fn warn_without_times(file: &str, samples: &Samples) {
    let is_timed = !samples.timeline.t.is_empty();
    let Some(step) = samples
        .apparent_step()
        .filter(|step| !is_timed && *step < LEAST_SECONDS)
    else {
        return;
    };
    let n_rows = samples.n_rows();
    messages::warning(format!(
        "{file}: rows seem to be {step:.2e} s apart, by their positions and speeds: all {n_rows} are taken for independent, \
         and where noise is alike from row to row the intervals are too narrow; {COLUMNS}"
    ));
}
