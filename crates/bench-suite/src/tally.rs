//! What became of the pieces of a run, counted.

use crate::run::{RunOutcome, Seconds};
use crate::store::Work;

/// Counts, and the names of what is not there.
#[derive(Debug, Default, Clone)]
pub struct Tally {
    /// Pieces asked for so far, over all shards.
    pub n_dealt: usize,
    /// Pieces that have a result.
    pub n_finished: usize,
    /// Of these, taken from earlier runs.
    pub n_reused: usize,
    /// Pieces that could not be computed, with the reason.
    pub failed: Vec<String>,
    /// Pieces left for another run.
    pub missing: Vec<String>,
    /// Where the time went.
    pub seconds: Seconds,
}

impl Tally {
    /// Of one outcome.
    pub fn of<W: Work>(outcome: &RunOutcome<W>) -> Self {
        let mut tally = Self::default();
        tally.add(outcome);
        tally
    }

    /// Counts pieces that are dealt; how many were dealt before them.
    pub fn count_dealt(&mut self, n: usize) -> usize {
        self.n_dealt += n;
        self.n_dealt - n
    }

    /// Adds an outcome.
    pub fn add<W: Work>(&mut self, outcome: &RunOutcome<W>) {
        self.n_finished += outcome.records.len();
        self.n_reused += outcome.n_reused;
        self.failed.extend(outcome.reasons());
        let missing = outcome.missing.iter().map(ToString::to_string);
        self.missing.extend(missing);
        self.seconds.data_set += outcome.seconds.data_set;
        self.seconds.cells += outcome.seconds.cells;
    }

    /// Pieces computed by this run.
    pub fn n_computed(&self) -> usize {
        self.n_finished - self.n_reused
    }
}
