//! What is not computed: said in the report, and refused where nothing else would be in it.

use super::Request;
use crate::error::BenchError;
use crate::multi::unit::Unit;
use crate::report::page::Page;
use crate::run::{Reuse, RunOutcome};
use crate::store::{MANY_MEASURED_BY, MEASURED_BY, Work};

/// Missing cells that the report names one by one.
const MOST_NAMED: usize = 40;

/// Refuses to report stored results where there are none.
///
/// # Errors
/// `NothingFinished`, with the directories of results that other versions of the sources left.
pub(super) fn refuse_empty(
    request: &Request,
    one: Option<&RunOutcome>,
    many: Option<&RunOutcome<Unit>>,
) -> Result<(), BenchError> {
    let n_records = one.map_or(0, |o| o.records.len()) + many.map_or(0, |o| o.records.len());
    let has_fits = one.is_some() || many.is_some();
    if request.reuse != Reuse::Results || !has_fits || n_records > 0 {
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

/// Adds what is missing, if anything is.
pub(super) fn part(page: &mut Page, one: Option<&RunOutcome>, many: Option<&RunOutcome<Unit>>) {
    let cells = one.map_or_else(Vec::new, missing);
    let units = many.map_or_else(Vec::new, missing);
    let all = [cells, units].concat();
    if all.is_empty() {
        return;
    }
    page.section("Not computed");
    page.prose("Averages are over what there is; the same command without `--from results` computes the rest.");
    page.list(&all[..all.len().min(MOST_NAMED)], "");
    if all.len() > MOST_NAMED {
        page.prose(&format!("And {} more.", all.len() - MOST_NAMED));
    }
}

fn missing<W: Work>(outcome: &RunOutcome<W>) -> Vec<String> {
    outcome.missing.iter().map(ToString::to_string).collect()
}
