#![doc = include_str!("../README.md")]

mod delimited;
mod error;
mod guess;
mod joint_state;
mod low_pass;
mod mapping;
mod prepare;
mod recording;
mod spool;
mod sqlite_bag;
mod time_base;
mod unit;

pub use delimited::DelimitedText;
pub use error::LogError;
pub use guess::guess;
pub use low_pass::{LowPass, derivative};
pub use mapping::{Columns, Mapping};
pub use prepare::{ABSURD, HYSTERESIS_LENGTHS, PreparedRun, Quantity, Settings, Tally, prepare};
pub use recording::{Measurement, Recording};
pub use spool::Spool;
pub use sqlite_bag::SqliteBag;
pub use time_base::{Stretch, TimeBase};
pub use unit::{EffortUnit, PositionUnit, TimeUnit, VelocityUnit};
