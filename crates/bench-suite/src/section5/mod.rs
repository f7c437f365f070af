//! The extensions that section 5 of the chapter asks for, measured: which load is it, a new load, control.
//!
//! An experiment is a file `experiments/<name>.toml` of kind `section5`, a module here, and a line in [`make`].
//! They share the models of [`trained`], which are fitted once.
//!
//! # Source
//! Section 5.

pub mod bench;
pub mod closed_loop;
pub mod context;
pub mod models;
mod normal;
pub mod novel;
pub mod page;
pub mod rbd;
pub mod sampled;
pub mod spec;
pub mod trained;
pub mod training_set;
pub mod transfer;

use self::bench::Bench;
use self::spec::Section5Experiment;
use crate::data_figures::section::Section;
use crate::error::BenchError;

/// Makes the tables and pictures of an experiment.
///
/// # Errors
/// `UnknownName` if no module makes an experiment of that name; `Experiment` if its settings are
/// not what the module reads; those of its models and pictures.
pub fn make(experiment: &Section5Experiment, bench: &Bench) -> Result<Section, BenchError> {
    match experiment.name.as_str() {
        "closed_loop" => closed_loop::make(experiment, bench),
        "context" => context::make(experiment, bench),
        "models" => models::make(experiment, bench),
        "novel" => novel::make(experiment, bench),
        "rbd" => rbd::make(experiment, bench),
        "sampled" => sampled::make(experiment, bench),
        "transfer" => transfer::make(experiment, bench),
        other => Err(BenchError::UnknownName {
            what: "experiment of section 5",
            name: other.to_string(),
            known: spec::Section5Experiment::names()?.join(", "),
        }),
    }
}
