//! What is not computed: said in the report, and refused where nothing else would be in it.

use super::request::Request;
use super::tallies::Tallies;
use crate::error::BenchError;
use crate::report::page::Page;
use crate::run::Reuse;
use crate::store::{MANY_MEASURED_BY, MEASURED_BY};

/// Missing cells that the report names one by one.
const MOST_NAMED: usize = 40;

/// Refuses to report stored results where there are none.
///
/// # Errors
/// `NothingFinished`, with the directories of results that other versions of the sources left.
pub(super) fn refuse_empty(request: &Request, tallies: &Tallies) -> Result<(), BenchError> {
    let n_finished: usize = tallies.all().map(|tally| tally.n_finished).sum();
    let has_work = tallies.all().next().is_some();
    if request.reuse != Reuse::Results || !has_work || n_finished > 0 {
        return Ok(());
    }
    let mut others = Vec::new();
    for (kind, own) in [("cells", MEASURED_BY), ("units", MANY_MEASURED_BY)] {
        let entries = std::fs::read_dir(request.output.join(kind));
        let names = entries.into_iter().flatten().flatten();
        let names = names.map(|entry| entry.file_name().to_string_lossy().into_owned());
        others.extend(
            names
                .filter(|name| name != own)
                .map(|name| format!("{kind}/{name}")),
        );
    }
    others.sort();
    Err(BenchError::NothingFinished {
        output: request.output.clone(),
        others,
    })
}

/// Adds what is missing, and what of section 5 failed, if anything is.
pub(super) fn part(page: &mut Page, tallies: &Tallies) {
    let missing: Vec<String> = tallies.all().flat_map(|t| &t.missing).cloned().collect();
    if !missing.is_empty() {
        page.section("Not computed");
        page.prose("Averages are over what there is, and a section of section 5 is here only when all its parts are; the same command without `--from results` computes the rest.");
        page.list(&missing[..missing.len().min(MOST_NAMED)], "");
        if missing.len() > MOST_NAMED {
            page.prose(&format!("And {} more.", missing.len() - MOST_NAMED));
        }
    }
    let failed = tallies
        .parts
        .as_ref()
        .map_or(&[][..], |tally| &tally.failed);
    if !failed.is_empty() {
        page.section("Parts without a result");
        page.list(failed, "");
    }
}
