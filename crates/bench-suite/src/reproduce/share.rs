//! The work of one shard, kept in the directory of results for whoever makes the report.

use super::{Request, run_many, run_one, scoped_many, scoped_one};
use crate::catalogue::Catalogue;
use crate::error::BenchError;
use crate::multi::unit::Unit;
use crate::run::RunOutcome;
use crate::store::Work;

/// What became of a shard's work.
#[derive(Debug)]
pub struct Share {
    /// Cells, if an experiment with one context was chosen.
    pub one: Option<RunOutcome>,
    /// Units, if an experiment with many contexts was chosen.
    pub many: Option<RunOutcome<Unit>>,
}

/// Computes what is missing of the request's shard, and writes no report.
///
/// # Errors
/// As for [`super::reproduce`].
pub fn compute(request: &Request) -> Result<Share, BenchError> {
    let Catalogue { one, many, .. } = Catalogue::named(&request.only)?;
    let one = scoped_one(one, request)?;
    let many = scoped_many(many, request)?;
    Ok(Share {
        one: run_one(&one, request)?,
        many: run_many(&many, request)?,
    })
}

impl Share {
    /// Whether everything could be computed.
    pub fn is_complete(&self) -> bool {
        self.failed().is_empty()
    }

    /// How many pieces were computed, were there before, failed and are missing.
    pub fn counts(&self) -> Vec<String> {
        let one = self.one.as_ref().map(|run| work_done(run, "cells"));
        let many = self.many.as_ref().map(|run| work_done(run, "units"));
        one.into_iter().chain(many).collect()
    }

    /// Pieces that could not be computed, with the reason.
    pub fn failed(&self) -> Vec<String> {
        let one = self.one.as_ref().map_or_else(Vec::new, RunOutcome::reasons);
        let many = self
            .many
            .as_ref()
            .map_or_else(Vec::new, RunOutcome::reasons);
        [one, many].concat()
    }
}

fn work_done<W: Work>(outcome: &RunOutcome<W>, name: &str) -> String {
    let seconds = &outcome.seconds;
    format!(
        "{} {name} were computed in {:.1} s (and the data set in {:.1} s), {} were taken from earlier runs, {} failed, {} are missing.",
        outcome.records.len() - outcome.n_reused,
        seconds.cells,
        seconds.data_set,
        outcome.n_reused,
        outcome.failures.len(),
        outcome.missing.len()
    )
}
