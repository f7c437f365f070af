//! The program as its users run it: files in, files or one message out.

mod command;
mod inverse_dynamics;
mod payloads;
mod readme;
mod refusals;
mod simulate;
