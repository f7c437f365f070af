//! Many contexts at once: the experiment of section 4.6, one unit of work a joint and a size.

pub mod bench;
pub mod draw;
pub mod measure;
pub mod model;
pub mod ranks;
mod rigid_body;
pub mod run;
pub mod shared;
pub mod spec;
pub mod unit;
