//! Cross-module tests of puma-dyn, one module per subject.

mod inverse_kin;
mod scenario;
mod urdf_arm;
mod urdf_files;
mod urdf_traps;
mod fixture;
mod pinocchio;
mod puma_files;
mod sidecar;
