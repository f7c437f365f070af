//! `reproduce-paper`: the cells of the chosen experiments, then their tables, pictures and findings.

mod files;
mod many_contexts;
mod one_context;
mod origin;
mod request;
mod sections;
mod share;
mod tallies;
mod unfinished;
mod unused;

use std::collections::BTreeSet;
use std::path::PathBuf;

pub use many_contexts::ManyContexts;
pub use one_context::OneContext;
pub use request::Request;
pub use share::{Share, compute};

use self::files::Files;
use self::tallies::Tallies;
use crate::catalogue::Catalogue;
use crate::cell::Cell;
use crate::error::BenchError;
use crate::manifest::Manifest;
use crate::multi;
use crate::multi::shared::SharedUnit;
use crate::multi::spec::{MultiExperiment, MultiScope};
use crate::multi::unit::Unit;
use crate::report::averages;
use crate::report::finding::Findings;
use crate::report::page::Page;
use crate::report::{differences, html, markdown};
use crate::run::{RunOutcome, run};
use crate::spec::{Experiment, Profile, Scope, Selection};
use crate::store::{self, Store};
use crate::tally::Tally;

/// What the chapter leaves open and what was chosen: a part of every report.
const DEVIATIONS: &str = include_str!("../../../../docs/DEVIATIONS.md");

/// Heading of the part about the data.
const DATA: &str = "The data (section 2)";

/// Heading of the part about section 5.
const PROPOSED: &str = "What the chapter proposes and does not run (sections 1, 3.2 and 5)";

/// What came out.
#[derive(Debug)]
pub struct Reproduction {
    /// Directory of this run's report.
    pub directory: PathBuf,
    /// What section 2 says of the data beside what was found, for the terminal.
    pub about_data: Findings,
    /// What section 3.4 gave, if one of its experiments was chosen.
    pub one: Option<OneContext>,
    /// What section 4.6 gave, if one of its experiments was chosen.
    pub many: Option<ManyContexts>,
    /// What section 5 asks for beside what was found, for the terminal.
    pub section5: Findings,
    /// How its work went, if one of its experiments was chosen.
    pub section5_work: Option<Tally>,
}

impl Reproduction {
    /// Whether everything that was asked for could be computed.
    pub fn is_complete(&self) -> bool {
        self.one
            .as_ref()
            .is_none_or(|one| one.outcome.failures.is_empty())
            && self
                .many
                .as_ref()
                .is_none_or(|many| many.outcome.failures.is_empty())
            && self
                .section5_work
                .as_ref()
                .is_none_or(|tally| tally.failed.is_empty())
    }
}

/// Runs the experiments and writes their report into a new directory.
///
/// # Errors
/// `UnknownName` if the request names an experiment that does not exist; `UnusedFlag` if it has a flag that
/// concerns none of those chosen; `Experiment` if a size cannot be shared out among the contexts;
/// `NothingFinished` if only stored results were asked for and there are none; `Io` if a file cannot be
/// written; the errors of [`run`].
pub fn reproduce(request: &Request) -> Result<Reproduction, BenchError> {
    let chosen = Catalogue::named(&request.only)?;
    unused::check(request, &chosen)?;
    let one = scoped(chosen.one, request, Experiment::reseeded, Experiment::scope)?;
    let many = scoped(
        chosen.many,
        request,
        MultiExperiment::reseeded,
        MultiExperiment::scope,
    )?;

    let mut manifest = Manifest::start(request.command.clone(), request.n_threads);
    manifest.seeds = seeds(&one, &many);
    let about_data = sections::about_data(&chosen.data)?;
    let of_one = run_one(&one, request)?;
    let of_many = run_many(&many, request)?;
    let of_shared = run_shared(&many, of_many.as_ref(), request)?;
    let (of_section5, section5_work) = sections::of_section5(&chosen.section5, request)?;
    let tallies = Tallies {
        cells: of_one.as_ref().map(Tally::of),
        units: of_many.as_ref().map(Tally::of),
        parts: section5_work,
    };
    unfinished::refuse_empty(request, &tallies)?;
    manifest.count(tallies.all());

    let mut files = Files::default();
    let mut page = Page::titled("The chapter's tables and figures");
    origin::part(&mut page, &manifest, &tallies);
    unfinished::part(&mut page, &tallies);
    let about_data = sections::part(DATA, &about_data, &mut page, &mut files);
    let one = of_one
        .map(|outcome| one_context::report(&one, outcome, &mut page, &mut files))
        .transpose()?;
    let many = of_many
        .map(|outcome| {
            let (outcomes, profile) = ((outcome, of_shared), request.profile);
            many_contexts::report(&many, profile, outcomes, &mut page, &mut files)
        })
        .transpose()?;
    let mut section5 = sections::part(PROPOSED, &of_section5, &mut page, &mut files);
    section5.retain(|(_, sentences)| !sentences.is_empty());
    differences_part(one.as_ref(), &mut page)?;
    page.document(DEVIATIONS);

    let text = toml::to_string(&manifest).map_err(|e| BenchError::malformed("manifest.toml", e))?;
    files.add("manifest.toml", text);
    write_pages(page, &mut files);
    let name = manifest.directory_name(request.profile.name());
    Ok(Reproduction {
        directory: files.write(&request.output, &name)?,
        about_data,
        one,
        many,
        section5,
        section5_work: tallies.parts,
    })
}

/// The page, which ends with a list of the other files, as Markdown and as HTML.
fn write_pages(mut page: Page, files: &mut Files) {
    page.part("Files beside this report");
    page.prose("Every number above is in one of these tables with all its digits.");
    page.table(&files.columns());
    page.prose("A column `record` names a file below `cells/` or `units/` of the output directory, which keeps the fit with its hyperparameters and all its searches.\nSeconds are in files of their own, so that all others are the same bytes whenever the results are the same.");
    let html = html::write(&page, |name| files.text(name));
    files.add("report.html", html);
    files.add("report.md", markdown::write(&page));
}

/// Published averages that ours do not meet.
fn differences_part(one: Option<&OneContext>, page: &mut Page) -> Result<(), BenchError> {
    let Some(one) = one.filter(|one| one.table3.is_some()) else {
        return Ok(());
    };
    page.part("What differs, and why");
    page.prose("Averages of table 3 outside 0.7 to 1.5 times the published value, those first that are worst for us; nothing was tuned to make them fewer.");
    let table = differences::table(&one.averages, &averages::published()?);
    if table.rows.is_empty() {
        page.prose("None.");
    } else {
        page.compared(&table);
        page.rows("cells.csv", "joint, model, n, set");
    }
    page.prose("Claims of the chapter that do not hold everywhere stand under the figures that they are about.");
    Ok(())
}

/// Seeds of all draws, without repetition.
fn seeds(one: &[(Experiment, Scope)], many: &[(MultiExperiment, MultiScope)]) -> Vec<String> {
    let of_many = many.iter().flat_map(|(e, _)| [&e.seed, &e.split_seed]);
    let seeds: BTreeSet<&String> = one.iter().map(|(e, _)| &e.seed).chain(of_many).collect();
    seeds.into_iter().cloned().collect()
}

/// Experiments under the seed of the request, each with what it computes.
fn scoped<E, S>(
    experiments: Vec<E>,
    request: &Request,
    reseeded: fn(E, &str) -> E,
    scope: fn(&E, Profile, &Selection) -> Result<S, BenchError>,
) -> Result<Vec<(E, S)>, BenchError> {
    let scoped = |experiment: E| {
        let experiment = match &request.seed {
            Some(seed) => reseeded(experiment, seed),
            None => experiment,
        };
        let scope = scope(&experiment, request.profile, &request.selection)?;
        Ok((experiment, scope))
    };
    experiments.into_iter().map(scoped).collect()
}

fn run_one(
    experiments: &[(Experiment, Scope)],
    request: &Request,
) -> Result<Option<RunOutcome>, BenchError> {
    if experiments.is_empty() {
        return Ok(None);
    }
    let cells: BTreeSet<Cell> = experiments
        .iter()
        .flat_map(|(experiment, scope)| experiment.cells(scope))
        .collect();
    let store = Store::open(store::of_cells(&request.output))?;
    run(
        &request.shard.of(cells),
        &store,
        request.reuse,
        request.n_threads,
    )
    .map(Some)
}

fn run_many(
    experiments: &[(MultiExperiment, MultiScope)],
    request: &Request,
) -> Result<Option<RunOutcome<Unit>>, BenchError> {
    if experiments.is_empty() {
        return Ok(None);
    }
    let n_repeats = 1 + request.selection.n_more_repeats;
    let units: BTreeSet<Unit> = experiments
        .iter()
        .flat_map(|(experiment, scope)| experiment.units(scope, n_repeats))
        .collect();
    let store = Store::open(store::of_units(&request.output))?;
    let units = request.shard.of(units);
    multi::run::run(&units, &store, request.reuse, request.n_threads).map(Some)
}

/// One K^ρ for all joints, where each joint has a fit of its own.
fn run_shared(
    experiments: &[(MultiExperiment, MultiScope)],
    separate: Option<&RunOutcome<Unit>>,
    request: &Request,
) -> Result<RunOutcome<SharedUnit>, BenchError> {
    let records = separate.map_or(&[][..], |outcome| &outcome.records);
    let units: BTreeSet<SharedUnit> = experiments
        .iter()
        .filter_map(|(_, scope)| Some((&scope.joints, scope.shared.as_ref()?)))
        .flat_map(|(joints, shared)| SharedUnit::all(records, joints, shared))
        .collect();
    let store = Store::open(store::of_units(&request.output))?;
    multi::run::run_shared(&units, records, &store, request.reuse, request.n_threads)
}
