//! Integration tests of the covariances.

#![allow(clippy::unwrap_used, reason = "a test fails where its premise does")]
#![allow(
    clippy::float_cmp,
    reason = "values worked by hand are exact in binary"
)]

mod accuracy;
mod eq_05;
mod eq_06;
mod eq_07;
mod laws;
mod rigid_body;
mod transforms;
