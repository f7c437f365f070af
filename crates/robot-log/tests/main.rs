//! Logs made into samples, against numbers of another program.

#![expect(clippy::unwrap_used, reason = "in a test a surprise is a failure")]

mod bag;
mod dialects;
mod golden;

use robot_log::{LogError, Recording, Settings, Tally, prepare};

/// t and the columns of every row of a recording's samples, as the default settings make them.
fn rows_of(recording: &mut dyn Recording) -> Result<(Vec<Vec<f64>>, Tally), LogError> {
    let mut rows = Vec::new();
    let tally = prepare::<LogError>(recording, &Settings::default(), |run| {
        let t = run.t.clone();
        run.columns.for_each_row(|row, values| {
            rows.push([&[t[row]], values].concat());
            Ok(())
        })
    })?;
    Ok((rows, tally))
}
