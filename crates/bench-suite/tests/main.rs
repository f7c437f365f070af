//! The experiment runner from outside: repeatable, resumable, and clear about wrong requests.

mod command_line;
mod repeatable;
mod section5;
mod units;
