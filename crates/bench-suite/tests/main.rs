//! The experiment runner from outside: repeatable, resumable, and clear about wrong requests.

mod adopt;
mod command_line;
mod pages;
mod repeatable;
mod section5;
mod survival;
mod units;
