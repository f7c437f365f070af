//! Integration tests of what is learned of a robot's torques.

#![allow(clippy::unwrap_used, reason = "a test fails where its premise does")]
#![allow(
    clippy::float_cmp,
    reason = "values worked by hand are exact in binary"
)]

mod allocations;
mod continuous_joints;
mod coverage;
mod damaged_file;
mod disjoint_stretches;
mod exported_robot;
mod extended_precision;
mod forged_files;
mod known_loads;
mod learning;
mod many_loads_file;
mod model_file;
mod multi_task_models;
mod new_load;
mod old_files;
mod online_load;
mod pick_up;
mod predictor;
mod rigid_body_file;
mod rigid_body_models;
mod rounding;
mod shared_parameters;
mod simulated_arm;
mod spacing;
mod threads;
mod torque_models;
