//! What is asked for, and what was found of it.

use std::path::PathBuf;

use super::models::OldModels;
use super::old::Olds;
use crate::cell::Cell;
use crate::multi::shared::SharedUnit;
use crate::multi::unit::Unit;
use crate::section5::part::Part;
use crate::section5::spec::Section5Experiment;
use crate::section5::transfer::Curve;

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
    pub experiments: Vec<Section5Experiment>,
}

/// Everything that was found, by kind of work.
pub struct Found {
    pub cells: Olds<Cell>,
    pub units: Olds<Unit>,
    pub shared: Olds<SharedUnit>,
    pub curves: Olds<Curve>,
    pub parts: Olds<Part>,
    pub models: OldModels,
    pub unread: Vec<String>,
}
