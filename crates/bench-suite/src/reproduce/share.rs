//! The work of one shard, kept in the directory of results for whoever makes the report.

use super::request::Request;
use super::tallies::Tallies;
use super::{run_many, run_one, scoped, sections};
use crate::catalogue::Catalogue;
use crate::error::BenchError;
use crate::multi::spec::MultiExperiment;
use crate::spec::Experiment;
use crate::tally::Tally;

/// What became of a shard's work.
#[derive(Debug)]
pub struct Share(Tallies);

/// Computes what is missing of the request's shard, and writes no report.
///
/// # Errors
/// As for [`super::reproduce`].
pub fn compute(request: &Request) -> Result<Share, BenchError> {
    let chosen = Catalogue::named(&request.only)?;
    let one = scoped(chosen.one, request, Experiment::reseeded, Experiment::scope)?;
    let many = scoped(
        chosen.many,
        request,
        MultiExperiment::reseeded,
        MultiExperiment::scope,
    )?;
    Ok(Share(Tallies {
        cells: run_one(&one, request)?.as_ref().map(Tally::of),
        units: run_many(&many, request)?.as_ref().map(Tally::of),
        parts: sections::of_section5(&chosen.section5, request)?.1,
    }))
}

impl Share {
    /// Whether everything could be computed.
    pub fn is_complete(&self) -> bool {
        self.failed().is_empty()
    }

    /// How many pieces were computed, were there before, failed and are missing.
    pub fn counts(&self) -> Vec<String> {
        self.0.named().map(work_done).collect()
    }

    /// Pieces that could not be computed, with the reason.
    pub fn failed(&self) -> Vec<String> {
        let failed = self.0.all().flat_map(|tally| &tally.failed);
        failed.cloned().collect()
    }
}

fn work_done((name, tally): (&str, &Tally)) -> String {
    let seconds = &tally.seconds;
    format!(
        "{} {name} were computed in {:.1} s (and the data set in {:.1} s), {} were taken from earlier runs, {} failed, {} are missing.",
        tally.n_computed(),
        seconds.cells,
        seconds.data_set,
        tally.n_reused,
        tally.failed.len(),
        tally.missing.len()
    )
}
