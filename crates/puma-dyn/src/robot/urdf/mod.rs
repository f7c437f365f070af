//! Robots from URDF files.

mod convert;
mod element;
mod load;
mod scan;

pub use load::{Loaded, load_urdf, parse_urdf};
