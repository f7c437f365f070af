//! The report's part on its own origin: command, revision, machine, seeds, what was computed and in what time.

use crate::manifest::Manifest;
use crate::report::page::Page;
use crate::report::text_table::TextTable;
use crate::run::RunOutcome;
use crate::store::Work;

/// Adds the part: what was run, and how the work went by kind of work.
pub(super) fn part(page: &mut Page, manifest: &Manifest, work: &[Vec<String>]) {
    page.part("What was run");
    page.command(&manifest.command);
    page.table(&facts(manifest));
    if !work.is_empty() {
        page.table(&TextTable {
            header: [
                "work",
                "computed",
                "seconds",
                "of that the data set",
                "taken from earlier runs",
                "failed",
                "missing",
            ]
            .map(String::from)
            .to_vec(),
            rows: work.to_vec(),
            n_left: 1,
        });
    }
    page.prose("A *cell* is one model of one joint under one load; a *unit* is all models of many loads at one joint and size.");
}

fn facts(manifest: &Manifest) -> TextTable {
    let threads = manifest.n_threads.to_string();
    let seeds = match manifest.seeds.join(", ") {
        none if none.is_empty() => "none: nothing was drawn at random".to_string(),
        seeds => seeds,
    };
    let rows = [
        ("revision", manifest.revision.as_str()),
        ("started", &manifest.started),
        ("processor", &manifest.cpu),
        ("threads", &threads),
        ("seeds", &seeds),
        ("sources of the cells", &manifest.measured_by),
        ("sources of the units", &manifest.many_measured_by),
        ("SHA-256 of Cargo.lock", &manifest.lock_file_sha256),
    ];
    TextTable {
        header: ["what", "value"].map(String::from).to_vec(),
        rows: rows
            .map(|(what, value)| vec![what.to_string(), value.to_string()])
            .to_vec(),
        n_left: 2,
    }
}

/// How the work of one kind went, as a row.
pub(super) fn work<W: Work>(name: &str, outcome: &RunOutcome<W>) -> Vec<String> {
    let seconds = &outcome.seconds;
    vec![
        name.to_string(),
        (outcome.records.len() - outcome.n_reused).to_string(),
        format!("{:.1}", seconds.cells + seconds.data_set),
        format!("{:.1}", seconds.data_set),
        outcome.n_reused.to_string(),
        outcome.failures.len().to_string(),
        outcome.missing.len().to_string(),
    ]
}
