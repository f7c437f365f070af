//! The chapter's experiments: data sets, splits, models, tables and figures.
#![doc = include_str!("../README.md")]

pub mod adopt;
pub mod catalogue;
pub mod cell;
pub mod data_figures;
pub mod dataset;
pub mod digest;
pub mod error;
mod experiment_file;
pub mod figure;
pub mod fit_summary;
pub mod manifest;
pub mod measure;
pub mod metrics;
pub mod models;
pub mod multi;
pub mod progress;
pub mod regression;
pub mod report;
pub mod reproduce;
mod revision;
pub mod rigid_body;
pub mod run;
pub mod section5;
pub mod section_experiment;
pub mod seed;
pub mod shard;
pub mod spec;
pub mod split;
pub mod store;
pub mod tally;

pub use error::BenchError;
