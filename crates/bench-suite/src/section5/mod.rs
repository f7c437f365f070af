//! The extensions that section 5 of the chapter asks for, measured: which load is it, a new load, control.
//!
//! An experiment is a file `experiments/<name>.toml` of kind `section5`, a module here, and a line in [`make`].
//! They share the models of [`trained`], which are fitted once.
//! The work of each is in pieces, which [`campaign`] reads, computes or leaves to other shards; its section is made
//! from their results alone.
//!
//! # Source
//! Section 5.

pub mod bench;
pub mod campaign;
pub mod closed_loop;
pub mod context;
pub mod models;
mod normal;
pub mod novel;
pub mod part;
pub mod rbd;
pub mod sampled;
pub mod trained;
pub mod training_set;
pub mod transfer;

use self::campaign::Campaign;
use crate::data_figures::section::Made;
use crate::error::BenchError;
use crate::section_experiment::{Kind, SectionExperiment};

/// Makes the tables and pictures of an experiment; `None` as long as a piece of its work is not there.
///
/// # Errors
/// `UnknownName` if no module makes an experiment of that name; `Experiment` if its settings are
/// not what the module reads; those of its models and pictures.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    match experiment.name.as_str() {
        "closed_loop" => closed_loop::make(experiment, campaign),
        "context" => context::make(experiment, campaign),
        "models" => models::make(experiment, campaign),
        "novel" => novel::make(experiment, campaign),
        "rbd" => rbd::make(experiment, campaign),
        "sampled" => sampled::make(experiment, campaign),
        "transfer" => transfer::make(experiment, campaign),
        other => Err(BenchError::UnknownName {
            what: "experiment of section 5",
            name: other.to_string(),
            known: SectionExperiment::names(Kind::Section5)?.join(", "),
        }),
    }
}
