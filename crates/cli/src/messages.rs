//! What the program says on standard error: one place, so that every line starts with its kind.
#![expect(
    clippy::print_stderr,
    reason = "a program talks to its user; results go elsewhere"
)]

use std::fmt::Display;

/// Something that may make the result meaningless.
pub fn warning(text: impl Display) {
    eprintln!("warning: {text}");
}

/// Something worth knowing.
pub fn note(text: impl Display) {
    eprintln!("note: {text}");
}

/// Why the program stops.
pub fn error(text: impl Display) {
    eprintln!("error: {text}");
}

/// A report of several lines that needs no kind.
pub fn report(text: impl Display) {
    eprint!("{text}");
}
