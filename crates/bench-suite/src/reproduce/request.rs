//! What is asked for.

use std::path::PathBuf;

use crate::run::Reuse;
use crate::shard::Shard;
use crate::spec::{Profile, Selection};

/// What to reproduce, and where to.
#[derive(Debug, Clone)]
pub struct Request {
    /// Amount of work.
    pub profile: Profile,
    /// Names of experiments; all if empty.
    pub only: Vec<String>,
    /// Directory of finished cells and reports.
    pub output: PathBuf,
    /// What to compute instead of what the profile says.
    pub selection: Selection,
    /// Part of the work that this run computes.
    pub shard: Shard,
    /// Threads, 0 for one a core.
    pub n_threads: usize,
    /// What may be taken from earlier runs.
    pub reuse: Reuse,
    /// Other draws than the experiments' own.
    pub seed: Option<String>,
    /// Command as a reader would type it.
    pub command: String,
}
