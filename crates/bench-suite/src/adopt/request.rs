//! What is asked for, and what was found of it.

use std::path::PathBuf;

use super::models::OldModels;
use super::old::Olds;
use crate::section_experiment::SectionExperiment;

/// What to adopt, and where to.
#[derive(Debug, Clone)]
pub struct Request {
    /// An output directory of an earlier revision, or one of the directories of results in it.
    pub from: PathBuf,
    /// Directory of finished cells and reports; may be the same.
    pub output: PathBuf,
    /// Results of each kind of work, model and size that are computed again.
    pub n_witnesses: usize,
    /// Threads, 0 for one a core.
    pub n_threads: usize,
    /// Experiments of section 5 that results may be of.
    pub experiments: Vec<SectionExperiment>,
}

/// Everything that was found.
pub struct Found {
    pub results: Olds,
    pub models: OldModels,
    pub unread: Vec<String>,
}
