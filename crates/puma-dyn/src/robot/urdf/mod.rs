//! Robots from URDF files.

mod convert;
mod element;
mod load;
mod scan;
mod write;

pub use load::{Loaded, load_urdf, parse_urdf};
pub use write::{JointDynamics, write_urdf};
