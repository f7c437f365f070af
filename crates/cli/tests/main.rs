//! The program as its users run it: files in, files or one message out.

#![expect(clippy::unwrap_used, reason = "in a test a surprise is a failure")]

mod command;
mod inverse_dynamics;
mod payloads;
mod readme;
mod refusals;
mod simulate;
