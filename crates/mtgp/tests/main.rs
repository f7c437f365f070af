//! Integration tests of the multi-task prior.

#![allow(clippy::unwrap_used, reason = "a test fails where its premise does")]
#![allow(
    clippy::float_cmp,
    reason = "values worked by hand are exact in binary"
)]

mod bad_input;
mod eq_16;
mod fixture;
mod identities;
mod laws;
mod layout;
