//! What URDF cannot say, from a file beside it.

mod joint_keys;
mod sidecar_file;

pub use joint_keys::JointKeys;
pub use sidecar_file::Sidecar;
