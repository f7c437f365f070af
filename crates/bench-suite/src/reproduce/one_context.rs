//! The report's part on section 3.4: table 3, figures 7 and 8, and what the chapter says of them.

use super::files::Files;
use crate::error::BenchError;
use crate::report::averages::{self, Averages};
use crate::report::finding::Findings;
use crate::report::page::Page;
use crate::report::text_table::TextTable;
use crate::report::{durations, fig07, fig08, findings, help, records_csv, searches, table3};
use crate::run::RunOutcome;
use crate::spec::{Experiment, Scope};

/// What came out of the experiments with one context.
#[derive(Debug)]
pub struct OneContext {
    /// Table 3, if it was among the experiments.
    pub table3: Option<TextTable>,
    /// Findings for the terminal, under their headings.
    pub findings: Findings,
    /// The run behind it.
    pub outcome: RunOutcome,
    /// Averages behind the tables.
    pub averages: Averages,
}

/// Sections and files; the table and the findings once more for the terminal.
pub(super) fn report(
    experiments: &[(Experiment, Scope)],
    outcome: RunOutcome,
    page: &mut Page,
    files: &mut Files,
) -> Result<OneContext, BenchError> {
    let averages = Averages::of(&outcome.records);
    page.part("One load at a time (section 3.4)");
    let mut table3 = None;
    let mut findings = Findings::new();
    for (experiment, scope) in experiments {
        page.section(&experiment.title);
        match experiment.name.as_str() {
            "table3" => {
                let (text, checks) = table3_part(experiment, scope, &averages, page, files)?;
                findings.extend(checks);
                table3 = Some(text);
            }
            "fig08" => findings.extend(fig08_part(scope, &outcome, page, files)?),
            _ => fig07_part(experiment, scope, &averages, page, files)?,
        }
        page.prose(&experiment.text.analysis);
    }

    findings.extend(claims(&averages, &outcome));
    findings.retain(|(_, items)| !items.is_empty());
    for (title, items) in &findings {
        page.section(title);
        page.list(items, "");
    }
    page.section("Where extrap is less than ten times harder than interp");
    let chapters = averages.of_the_chapter();
    page.list(&findings::extrap_is_harder(&chapters), "Nowhere.");
    about_fits(&outcome, page);
    page.section("Every average");
    page.table(&table3::all_averages(&averages));
    page.rows("averages.csv", "joint, model, set, n");

    files.add("averages.csv", averages.to_csv());
    files.add("cells.csv", records_csv::cells(&outcome.records));
    files.add("seconds.csv", records_csv::seconds(&outcome.records));
    Ok(OneContext {
        table3,
        findings,
        outcome,
        averages,
    })
}

/// How the searches ended, which fits needed help, and where the time went.
fn about_fits(outcome: &RunOutcome, page: &mut Page) {
    page.section(help::TITLE);
    page.table(&help::of_cells(&outcome.records));
    page.rows("cells.csv", "joint, load, model, n");
    page.prose(help::EXPLANATION);
    page.section(searches::TITLE);
    page.table(&searches::by_model_and_size(&outcome.records));
    page.rows("cells.csv", "joint, load, model, n");
    page.section(durations::OF_CELLS);
    page.table(&durations::of_cells(&outcome.records));
    page.rows("seconds.csv", "joint, load, model, n");
}

fn table3_part(
    experiment: &Experiment,
    scope: &Scope,
    averages: &Averages,
    page: &mut Page,
    files: &mut Files,
) -> Result<(TextTable, Findings), BenchError> {
    let published = averages::published()?;
    let table = table3::beside_published(averages, &published, &experiment.models, scope);
    page.compared(&table);
    page.rows("table3.csv", "joint, model, set, n");
    page.prose("The loads behind an average are in `cells.csv` under the same joint, model, set and n; its column `record` names the file below `cells/` that keeps the fit.");
    page.claims(&[findings::table3_claim(averages, &published)]);
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
    page.rows("averages.csv", "joint, model, set, n");
    let chapters = averages.of_the_chapter();
    let claims = [
        findings::order_claim(&chapters),
        findings::extrap_claim(&chapters),
        findings::range_claim(&chapters),
    ];
    page.claims(&claims.into_iter().flatten().collect::<Vec<_>>());
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
    files.add("fig08.csv", fig08::to_csv(&rows, subject));
    page.picture("Hinton diagrams of the hyperparameters", "fig08.png");
    page.rows("fig08.csv", "torque, weight_of, joint");
    page.claims(&[fig08::claim(&rows)]);
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
    claims.push(("Cells without a result".into(), outcome.reasons()));
    claims
}
