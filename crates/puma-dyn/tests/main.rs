//! Cross-module tests of puma-dyn, one module per subject.

mod allocations;
mod classical;
mod closed_loop;
mod context_rank;
mod fixture;
mod golden;
mod identities;
mod inverse_kin;
mod payload_merge;
mod pinocchio;
mod puma_files;
mod random_tree;
mod scenario;
mod sidecar;
mod simulation;
mod smooth_friction;
mod smooth_simulation;
mod stick_slip;
mod urdf_arm;
mod urdf_files;
mod urdf_traps;
mod urdf_writing;
mod validation;
