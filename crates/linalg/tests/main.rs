//! Integration tests of the linear algebra.

#![allow(clippy::unwrap_used, reason = "a test fails where its premise does")]

mod factor;
