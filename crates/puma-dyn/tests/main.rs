//! Cross-module tests of puma-dyn, one module per subject.

mod inverse_kin;
mod scenario;
mod urdf_traps;
