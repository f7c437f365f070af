//! The report's part on its own origin: command, revision, machine, seeds, what was computed and in what time.

use super::tallies::Tallies;
use crate::manifest::Manifest;
use crate::report::page::Page;
use crate::report::text_table::TextTable;
use crate::tally::Tally;

/// Adds the part: what was run, and how the work went by kind of work.
pub(super) fn part(page: &mut Page, manifest: &Manifest, tallies: &Tallies) {
    page.part("What was run");
    page.command(&manifest.command);
    page.table(&facts(manifest));
    let work: Vec<Vec<String>> = tallies.named().map(row).collect();
    if !work.is_empty() {
        page.table(&TextTable::new(
            1,
            [
                "work",
                "computed",
                "seconds",
                "of that the data set",
                "taken from earlier runs",
                "failed",
                "missing",
            ],
            work,
        ));
    }
    page.prose("A *cell* is one model of one joint under one load; a *unit* is all models of many loads at one joint and size; a *part* is one of those that an experiment of section 5 divides into.");
}

fn facts(manifest: &Manifest) -> TextTable {
    let threads = manifest.n_threads.to_string();
    let seeds = match manifest.seeds.join(", ") {
        none if none.is_empty() => "none: nothing was drawn at random".to_string(),
        seeds => seeds,
    };
    let mut rows = vec![("revision", manifest.revision.as_str())];
    if manifest.compiled_from != manifest.revision {
        rows.push((
            "revision that the program was compiled from",
            &manifest.compiled_from,
        ));
    }
    rows.extend([
        ("started", manifest.started.as_str()),
        ("processor", &manifest.cpu),
        ("threads", &threads),
        ("seeds", &seeds),
        ("sources of the cells", &manifest.measured_by),
        ("sources of the units", &manifest.many_measured_by),
        ("SHA-256 of Cargo.lock", &manifest.lock_file_sha256),
    ]);
    TextTable::new(
        2,
        ["what", "value"],
        (rows.into_iter()).map(|(what, value)| vec![what.to_string(), value.to_string()]),
    )
}

/// How the work of one kind went.
fn row((name, tally): (&str, &Tally)) -> Vec<String> {
    let seconds = &tally.seconds;
    vec![
        name.to_string(),
        tally.n_computed().to_string(),
        format!("{:.1}", seconds.cells + seconds.data_set),
        format!("{:.1}", seconds.data_set),
        tally.n_reused.to_string(),
        tally.failed.len().to_string(),
        tally.missing.len().to_string(),
    ]
}
