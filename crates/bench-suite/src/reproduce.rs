//! `reproduce-paper`: the cells of the chosen experiments, then their tables, pictures and findings.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::catalogue::Catalogue;
use crate::cell::Cell;
use crate::data_figures::page;
use crate::data_figures::section::Section;
use crate::data_figures::spec::DataExperiment;
use crate::error::BenchError;
use crate::manifest::Manifest;
use crate::report::averages::{self, Averages};
use crate::report::markdown::Page;
use crate::report::text_table::TextTable;
use crate::report::{durations, fig07, fig08, findings, records_csv, table3};
use crate::run::{Reuse, RunOutcome, run};
use crate::spec::{Experiment, Profile, Scope, Selection};
use crate::store::{MEASURED_BY, Store, write_atomically};

/// What to reproduce, and where to.
#[derive(Debug, Clone)]
pub struct Request {
    /// Amount of work.
    pub profile: Profile,
    /// Names of experiments; all if empty.
    pub only: Vec<String>,
    /// Directory of finished cells and reports.
    pub output: PathBuf,
    /// Loads, joints and sizes instead of the profile's.
    pub selection: Selection,
    /// Threads, 0 for one a core.
    pub n_threads: usize,
    /// What may be taken from earlier runs.
    pub reuse: Reuse,
    /// Command as a reader would type it.
    pub command: String,
}

/// What came out.
#[derive(Debug)]
pub struct Reproduction {
    /// Directory of this run's report.
    pub directory: PathBuf,
    /// Table 3, if it was among the experiments.
    pub table3: Option<TextTable>,
    /// Findings for the terminal, under their headings.
    pub findings: Vec<(String, Vec<String>)>,
    /// The run behind it.
    pub outcome: RunOutcome,
    /// Averages behind the tables.
    pub averages: Averages,
}

/// Runs the experiments and writes their report into a new directory.
///
/// # Errors
/// `UnknownName` if the request names an experiment that does not exist; `Io` if a file cannot be
/// written; the errors of [`run`].
pub fn reproduce(request: &Request) -> Result<Reproduction, BenchError> {
    let catalogue = Catalogue::named(&request.only)?;
    let experiments = scoped(catalogue.one, request)?;
    let cells: BTreeSet<Cell> = experiments
        .iter()
        .flat_map(|(experiment, scope)| experiment.cells(scope))
        .collect();
    let store = Store::open(request.output.join("cells").join(MEASURED_BY))?;

    let mut manifest = Manifest::start(request.command.clone(), request.n_threads);
    let about_data = page::sections(&catalogue.data)?;
    let outcome = run(&cells, &store, request.reuse, request.n_threads)?;
    manifest.n_reused = outcome.n_reused;
    manifest.n_computed = outcome.records.len() - outcome.n_reused;
    manifest.seconds = outcome.seconds.clone();

    let averages = Averages::of(&outcome.records);
    let mut files = Files::default();
    let mut page = Page::titled("The chapter's tables and figures");
    page.command(&manifest.command);
    page.prose(&origin(&manifest, &outcome));
    let mut found = data_part(&about_data, &mut page, &mut files);
    let mut table = None;
    if !experiments.is_empty() {
        let (text, claims) = cells_part(&experiments, &averages, &outcome, &mut page, &mut files)?;
        table = text;
        found.extend(claims);
    }
    files.add("report.md", page.into_text());
    let text = toml::to_string(&manifest).map_err(|e| BenchError::malformed("manifest.toml", e))?;
    files.add("manifest.toml", text);
    let name = manifest.directory_name(request.profile.name());
    Ok(Reproduction {
        directory: files.write(&request.output, &name)?,
        table3: table,
        findings: found,
        outcome,
        averages,
    })
}

fn scoped(
    experiments: Vec<Experiment>,
    request: &Request,
) -> Result<Vec<(Experiment, Scope)>, BenchError> {
    experiments
        .into_iter()
        .map(|experiment| {
            let scope = experiment.scope(request.profile, &request.selection)?;
            Ok((experiment, scope))
        })
        .collect()
}

type Findings = Vec<(String, Vec<String>)>;

/// Sections and files about the data; the findings once more for the terminal.
fn data_part(
    sections: &[(&DataExperiment, Section)],
    page: &mut Page,
    files: &mut Files,
) -> Findings {
    let mut found = Findings::new();
    for (experiment, section) in sections {
        page::write(page, experiment, section);
        for (name, contents) in &section.files {
            files.add(name, contents.clone());
        }
        found.push((experiment.title.clone(), page::sentences(section)));
    }
    found
}

/// Sections and files of the experiments made of cells; the table and the findings once more for the terminal.
fn cells_part(
    experiments: &[(Experiment, Scope)],
    averages: &Averages,
    outcome: &RunOutcome,
    page: &mut Page,
    files: &mut Files,
) -> Result<(Option<TextTable>, Findings), BenchError> {
    let mut table = None;
    let mut found = Findings::new();

    for (experiment, scope) in experiments {
        page.section(&experiment.title);
        match experiment.name.as_str() {
            "table3" => {
                let (text, checks) = table3_part(experiment, scope, averages, files)?;
                page.table(&text);
                found.extend(checks);
                table = Some(text);
            }
            "fig08" => found.extend(fig08_part(scope, outcome, page, files)?),
            _ => fig07_part(experiment, scope, averages, page, files)?,
        }
        page.prose(&experiment.text.analysis);
    }

    found.extend(claims(averages, outcome));
    found.retain(|(_, items)| !items.is_empty());
    for (title, items) in &found {
        page.section(title);
        page.list(items, "");
    }
    page.section("Where extrap is less than ten times harder than interp");
    page.list(&findings::extrap_is_harder(averages), "Nowhere.");
    let durations = durations::by_model_and_size(&outcome.records);
    page.section(durations::TITLE);
    page.table(&durations);
    page.section("Every average");
    page.table(&table3::all_averages(averages));

    files.add("averages.csv", averages::write_table(averages));
    files.add("cells.csv", records_csv::cells(&outcome.records));
    files.add("seconds.csv", records_csv::seconds(&outcome.records));
    Ok((table, found))
}

fn table3_part(
    experiment: &Experiment,
    scope: &Scope,
    averages: &Averages,
    files: &mut Files,
) -> Result<(TextTable, Findings), BenchError> {
    let published = averages::published()?;
    let table = table3::beside_published(averages, &published, &experiment.models, scope);
    let csv = table3::to_csv(averages, &published, &experiment.models, scope);
    files.add("table3.csv", csv);
    let checks = experiment.expect.as_ref().map(|expect| {
        let title = format!(
            "{} at n = {} against the published rows",
            expect.reference_model.label(),
            expect.size
        );
        (
            title,
            findings::beside_published(averages, &published, expect),
        )
    });
    Ok((table, checks.into_iter().collect()))
}

fn fig07_part(
    experiment: &Experiment,
    scope: &Scope,
    averages: &Averages,
    page: &mut Page,
    files: &mut Files,
) -> Result<(), BenchError> {
    let picture = fig07::draw(averages, &experiment.models, scope);
    files.add("fig07.png", picture.to_png()?);
    files.add("fig07.svg", picture.to_svg());
    page.picture("Hinton diagram of the average nMSE", "fig07.png");
    Ok(())
}

fn fig08_part(
    scope: &Scope,
    outcome: &RunOutcome,
    page: &mut Page,
    files: &mut Files,
) -> Result<Findings, BenchError> {
    let rows = fig08::rows(&outcome.records, scope);
    let Some(subject) = fig08::subject(scope).filter(|_| !rows.is_empty()) else {
        page.prose("No finished cell of this figure.");
        return Ok(Findings::new());
    };
    let picture = fig08::draw(&rows, subject);
    files.add("fig08.png", picture.to_png()?);
    files.add("fig08.svg", picture.to_svg());
    page.picture("Hinton diagrams of the hyperparameters", "fig08.png");
    Ok(vec![(
        "Row maxima of figure 8".into(),
        fig08::findings(&rows),
    )])
}

/// The chapter's claims about the averages, and the cells that failed.
fn claims(averages: &Averages, outcome: &RunOutcome) -> Findings {
    let mut claims = Findings::new();
    for n in averages.sizes().into_iter().filter(|&n| n >= 170) {
        let found = findings::gpc_against_lrc(averages, &outcome.records, n);
        claims.push((format!("GPc against LRc at n = {n}"), found));
    }
    claims.push(("Order of the models".into(), findings::order(averages)));
    let failed = outcome
        .failures
        .iter()
        .map(|(cell, error)| format!("{cell}: {error}."));
    claims.push(("Cells without a result".into(), failed.collect()));
    claims
}

fn origin(manifest: &Manifest, outcome: &RunOutcome) -> String {
    let Manifest {
        revision,
        started,
        cpu,
        n_threads,
        ..
    } = manifest;
    let seconds = &outcome.seconds;
    format!(
        "Made by the command above at revision {revision}, started {started}, on {cpu} with {n_threads} threads.\n\
         {} cells were computed in {:.1} s (and the data set in {:.1} s), {} were taken from earlier runs, {} failed, {} are missing.",
        manifest.n_computed,
        seconds.cells,
        seconds.data_set,
        manifest.n_reused,
        outcome.failures.len(),
        outcome.n_missing
    )
}

/// Files of a report, kept in memory until all of them exist.
#[derive(Default)]
struct Files(Vec<(String, Vec<u8>)>);

impl Files {
    fn add(&mut self, name: &str, contents: impl Into<Vec<u8>>) {
        self.0.push((name.to_string(), contents.into()));
    }

    /// Writes everything into a new directory, which appears only when it is complete.
    fn write(&self, output: &Path, name: &str) -> Result<PathBuf, BenchError> {
        let partial = output.join(format!(".{name}.{}.partial", std::process::id()));
        std::fs::create_dir_all(&partial).map_err(BenchError::io(&partial))?;
        for (file, contents) in &self.0 {
            write_atomically(&partial.join(file), contents)?;
        }
        let directory = free_name(output, name);
        std::fs::rename(&partial, &directory).map_err(BenchError::io(&directory))?;
        Ok(directory)
    }
}

/// The name, or the name with the first number that makes it new.
fn free_name(output: &Path, name: &str) -> PathBuf {
    let numbered = (2..).map(|i| output.join(format!("{name}-{i}")));
    let mut candidates = std::iter::once(output.join(name)).chain(numbered);
    let is_free = |path: &PathBuf| !path.exists();
    candidates
        .find(is_free)
        .unwrap_or_else(|| output.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_overwritten_and_nothing_partial_remains() {
        let dir = tempfile::tempdir().unwrap();
        let mut files = Files::default();
        files.add("a.txt", "a");
        let first = files.write(dir.path(), "run").unwrap();
        let second = files.write(dir.path(), "run").unwrap();
        assert_ne!(first, second);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
        assert_eq!(std::fs::read_to_string(second.join("a.txt")).unwrap(), "a");
    }
}
