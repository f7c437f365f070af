//! Cross-module tests of puma-dyn, one module per subject.

mod fixture;
mod inverse_kin;
mod pinocchio;
mod puma_files;
mod scenario;
mod sidecar;
mod urdf_arm;
mod urdf_files;
mod urdf_traps;
mod allocations;
mod classical;
mod golden;
mod identities;
mod payload_merge;
mod random_tree;
mod validation;
