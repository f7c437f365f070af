//! Integration tests of Gaussian-process regression.

#![allow(clippy::unwrap_used, reason = "a test fails where its premise does")]
#![allow(
    clippy::float_cmp,
    reason = "values worked by hand are exact in binary"
)]

mod certified;
mod curves;
mod eq_04;
mod eq_08;
mod eq_09;
mod eq_22;
mod failures;
mod fixture;
mod further_samples;
mod joint_covariance;
mod linear_evidence;
mod low_rank_posterior;
mod memory;
mod optimizer;
mod recovery;
mod rigid_body;
mod samples;
mod sampling;
mod threads;
