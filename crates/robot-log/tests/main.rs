//! Logs made into samples, against numbers of another program.

mod dialects;
mod golden;
