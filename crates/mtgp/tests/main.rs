//! Integration tests of the multi-task prior.

#![allow(clippy::unwrap_used, reason = "a test fails where its premise does")]
#![allow(
    clippy::float_cmp,
    reason = "values worked by hand are exact in binary"
)]

mod all_tasks;
mod bad_input;
mod context_filter;
mod described_tasks;
mod eq_16;
mod eq_17;
mod eq_18;
mod eq_19;
mod eq_21;
mod eq_23_26;
mod eq_28;
mod fixture;
mod icm_draws;
mod identities;
mod laws;
mod layout;
mod many_samples;
mod memory;
mod novel_context;
mod row_population;
mod shared_factor;
mod staged;
mod task_noise;
mod task_regression;
mod textbook;
mod unknown_context;
