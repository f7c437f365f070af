//! The report's part on section 4.6: figures 10 and 11, ranks and starts, and who is best where.

use super::files::Files;
use crate::cell::TestSet;
use crate::error::BenchError;
use crate::multi::ranks::Choices;
use crate::multi::shared::SharedUnit;
use crate::multi::spec::{MultiExperiment, MultiScope};
use crate::multi::unit::Unit;
use crate::report::curves::Curves;
use crate::report::fig10::{self, Scale};
use crate::report::finding::Findings;
use crate::report::page::Page;
use crate::report::published_fig10::Published;
use crate::report::text_table::TextTable;
use crate::report::{choices, durations, help, multi_csv, shared, standings};
use crate::run::RunOutcome;
use crate::spec::Profile;

/// What came out of the experiments with many contexts.
#[derive(Debug)]
pub struct ManyContexts {
    /// The run behind it.
    pub outcome: RunOutcome<Unit>,
    /// Lines of the figures.
    pub curves: Curves,
    /// Chosen ranks and starts beside the chapter's, for the terminal.
    pub table: TextTable,
    /// Findings for the terminal, under their headings.
    pub findings: Findings,
}

/// Sections and files.
pub(super) fn report(
    experiments: &[(MultiExperiment, MultiScope)],
    profile: Profile,
    (outcome, of_shared): (RunOutcome<Unit>, RunOutcome<SharedUnit>),
    page: &mut Page,
    files: &mut Files,
) -> Result<ManyContexts, BenchError> {
    let chosen = Choices::of(&outcome.records)?;
    let curves = Curves::of(&outcome.records, &chosen);
    let drawn = curves.with_shared(&of_shared.records);
    let mut findings = Findings::new();
    page.part("Many loads at once (section 4.6)");
    for (experiment, scope) in experiments {
        page.section(&experiment.title);
        pictures(experiment.set, &drawn, page, files)?;
        page.rows("curves.csv", "joint, set, statistic, series, n");
        page.claims(&standings::claims(&curves, experiment.set));
        page.prose(&experiment.text.analysis);
        let is_complete = experiment.profile.get(&Profile::Full) == Some(scope);
        let at_least = is_complete.then_some(experiment.expect.lowest_at_least);
        let title = format!("Lowest averages on {}", experiment.set.name());
        findings.push((
            title,
            standings::standings(&curves, experiment.set, at_least),
        ));
    }
    let failed = [outcome.reasons(), of_shared.reasons()].concat();
    findings.push(("Units without a result".into(), failed));
    findings.retain(|(_, items)| !items.is_empty());
    for (title, items) in &findings {
        page.section(title);
        page.list(items, "");
    }

    let table = about_ranks(&outcome, &chosen, profile, page)?;
    about_shared(&of_shared, &chosen, &curves, page, files);
    page.section(help::TITLE);
    page.table(&help::of_units(&outcome.records));
    page.rows("fits.csv", "draw, joint, n, model, fit");
    page.prose(help::EXPLANATION);
    page.section(durations::OF_UNITS);
    page.table(&durations::of_units(&outcome.records));
    page.rows("unit_seconds.csv", "draw, joint, n, model");

    files.add("curves.csv", multi_csv::curves(&drawn));
    files.add("contexts.csv", multi_csv::scores(&outcome.records));
    files.add("fits.csv", multi_csv::fits(&outcome.records));
    files.add("unit_seconds.csv", multi_csv::seconds(&outcome.records));
    Ok(ManyContexts {
        outcome,
        curves,
        table,
        findings,
    })
}

/// Chosen ranks and starts beside the chapter's.
fn about_ranks(
    outcome: &RunOutcome<Unit>,
    chosen: &Choices,
    profile: Profile,
    page: &mut Page,
) -> Result<TextTable, BenchError> {
    let published = Published::read()?;
    let table = choices::ranks_and_starts(&outcome.records, chosen, &published);
    page.section(
        "Ranks chosen by BIC and models that the mGPs start from (in parentheses: the chapter's)",
    );
    page.table(&table);
    page.rows("fits.csv", "draw, joint, n, model");
    page.claims(&choices::claims(&outcome.records, chosen, &published));
    if profile == Profile::Smoke {
        page.prose("The chapter chooses among more ranks and for all six joints together.");
    }
    page.section("BIC above the least of its row");
    page.table(&choices::bic_differences(chosen));
    page.rows("fits.csv", "draw, n, model");
    Ok(table)
}

/// One K^ρ for all joints, where there is a result.
fn about_shared(
    outcome: &RunOutcome<SharedUnit>,
    chosen: &Choices,
    curves: &Curves,
    page: &mut Page,
    files: &mut Files,
) {
    let records = &outcome.records;
    if records.is_empty() {
        return;
    }
    page.section(shared::TITLE);
    page.table(&shared::table(records, chosen, curves));
    page.rows("shared_fits.csv", "draw, n, rank");
    page.claims(&shared::claims(records, chosen, curves));
    page.prose(shared::EXPLANATION);
    files.add("shared_fits.csv", shared::fits(records));
    files.add("shared_contexts.csv", shared::scores(records));
}

/// A figure with the chapter's axes and with logarithmic ones.
fn pictures(
    set: TestSet,
    curves: &Curves,
    page: &mut Page,
    files: &mut Files,
) -> Result<(), BenchError> {
    let names = match set {
        TestSet::Interp => [
            ("fig10.png", "fig10.svg"),
            ("fig10_log.png", "fig10_log.svg"),
        ],
        TestSet::Extrap => [
            ("fig11.png", "fig11.svg"),
            ("fig11_log.png", "fig11_log.svg"),
        ],
    };
    for ((png, svg), scale) in names.into_iter().zip([Scale::Chapter, Scale::Log]) {
        let picture = fig10::draw(curves, set, scale)?;
        files.add(png, picture.to_png()?);
        files.add(svg, picture.to_svg());
        page.picture("Average and median nMSE against n", png);
    }
    Ok(())
}
