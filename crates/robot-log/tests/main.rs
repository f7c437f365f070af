//! Logs made into samples, against numbers of another program.

#![expect(clippy::unwrap_used, reason = "in a test a surprise is a failure")]

mod bag;
mod dialects;
mod golden;
