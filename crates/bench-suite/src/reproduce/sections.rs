//! The report's parts on the data and on section 5, whose experiments make one section each.

use super::files::Files;
use super::request::Request;
use crate::data_figures;
use crate::data_figures::samples::Samples;
use crate::data_figures::section::{Finding, Section};
use crate::error::BenchError;
use crate::report::finding::{self, Findings};
use crate::report::page::Page;
use crate::section_experiment::{Kind, SectionExperiment};
use crate::section5;
use crate::section5::campaign::Campaign;
use crate::tally::Tally;

/// Sections with the experiments that they are of.
pub(super) type Sections<'a> = Vec<(&'a SectionExperiment, Section)>;

/// Sections about the data.
///
/// # Errors
/// Those of [`Samples::reference`] and [`data_figures::make`].
pub(super) fn about_data(experiments: &[SectionExperiment]) -> Result<Sections<'_>, BenchError> {
    if experiments.is_empty() {
        return Ok(Vec::new());
    }
    let samples = Samples::reference()?;
    let make = |experiment: &SectionExperiment| data_figures::make(&experiment.name, &samples);
    let sections = experiments.iter();
    sections.map(|one| Ok((one, make(one)?))).collect()
}

/// Sections of section 5 whose work is all there, and how the work went.
///
/// # Errors
/// Those of [`section5::make`].
pub(super) fn of_section5<'a>(
    experiments: &'a [SectionExperiment],
    request: &Request,
) -> Result<(Sections<'a>, Option<Tally>), BenchError> {
    if experiments.is_empty() {
        return Ok((Vec::new(), None));
    }
    let campaign = Campaign::new(request.profile, &request.output, request.reuse)
        .with_shard(request.shard)
        .with_threads(request.n_threads);
    let section = |experiment| {
        let section = section5::make(experiment, &campaign).transpose()?;
        Some(section.map(|section| (experiment, section)))
    };
    let sections = experiments.iter().filter_map(section);
    let sections = sections.collect::<Result<_, BenchError>>()?;
    Ok((sections, Some(campaign.into_tally())))
}

/// Sections under the heading of their part, and their files; the findings once more for the terminal.
///
/// Of each there is picture, table, claims or what was asked for beside findings, and how to read it.
pub(super) fn part(
    heading: &str,
    sections: &Sections<'_>,
    page: &mut Page,
    files: &mut Files,
) -> Findings {
    let mut found = Findings::new();
    if !sections.is_empty() {
        page.part(heading);
    }
    for (experiment, section) in sections {
        section.put_on(page, &experiment.title);
        let findings = &section.findings;
        match experiment.kind {
            Kind::Data => page.claims(findings),
            Kind::Section5 if findings.is_empty() => {}
            Kind::Section5 => page.table(&finding::under(["asked for", "found"], findings)),
        }
        page.prose(&experiment.text.analysis);
        for (name, contents) in &section.files {
            files.add(name, contents.clone());
        }
        let sentences = findings.iter().map(|one| sentence(experiment.kind, one));
        found.push((experiment.title.clone(), sentences.collect()));
    }
    found
}

fn sentence(kind: Kind, finding: &Finding) -> String {
    let Finding { chapter, here } = finding;
    match kind {
        Kind::Data => format!("chapter: {chapter}; here: {here}."),
        Kind::Section5 => format!("{chapter}: {here}."),
    }
}
