//! The program as its users run it: files in, files or one message out.

#![expect(clippy::unwrap_used, reason = "in a test a surprise is a failure")]

mod command;
mod contexts;
mod continuous;
mod control;
mod inverse_dynamics;
mod known_loads;
mod learning;
mod learning_refusals;
mod likelihood;
mod likelihood_contexts;
mod log_columns;
mod new_contexts;
mod payloads;
mod prepare;
mod puma_samples;
mod readme;
mod real_arm;
mod real_robot;
mod refusals;
mod rigid_body;
mod row_spacing;
mod sample;
mod simulate;
mod smooth_friction;
mod spoilt_files;
mod torque_scale;
