//! What the program says on standard error: one place, so that every line starts with its kind.
//!
//! A reader who has gone, as in `2>&1 | head`, is no reason to stop.

use std::fmt::Display;
use std::io::{Write, stderr};

/// Something that may make the result meaningless.
pub fn warning(text: impl Display) {
    drop(writeln!(stderr(), "warning: {text}"));
}

/// Something worth knowing.
pub fn note(text: impl Display) {
    drop(writeln!(stderr(), "note: {text}"));
}

/// Why the program stops.
pub fn error(text: impl Display) {
    drop(writeln!(stderr(), "error: {text}"));
}

/// A report of several lines that needs no kind.
pub fn report(text: impl Display) {
    drop(write!(stderr(), "{text}"));
}
