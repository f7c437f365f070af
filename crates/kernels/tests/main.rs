//! Integration tests of the covariances.

mod accuracy;
mod eq_05;
mod eq_06;
mod eq_07;
mod laws;
mod transforms;
