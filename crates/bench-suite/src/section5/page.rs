//! The sections of the report about section 5.

use super::campaign::Campaign;
use super::make;
use super::spec::Section5Experiment;
use crate::data_figures::section::Section;
use crate::error::BenchError;
use crate::report::finding;
use crate::report::page::Page;

/// Sections of the experiments whose work is all there, each with its description.
///
/// # Errors
/// Those of [`make`].
pub fn sections<'a>(
    experiments: &'a [Section5Experiment],
    campaign: &Campaign,
) -> Result<Vec<(&'a Section5Experiment, Section)>, BenchError> {
    let section = |experiment| {
        let section = make(experiment, campaign).transpose()?;
        Some(section.map(|section| (experiment, section)))
    };
    experiments.iter().filter_map(section).collect()
}

/// Adds one section to the page: picture, table, what was asked for beside what was found, and how to read it.
pub fn write(page: &mut Page, experiment: &Section5Experiment, section: &Section) {
    section.put_on(page, &experiment.title);
    if !section.findings.is_empty() {
        page.table(&finding::under(["asked for", "found"], &section.findings));
    }
    page.prose(&experiment.text.analysis);
}

/// The findings as sentences for the terminal.
pub fn sentences(section: &Section) -> Vec<String> {
    let sentence = |finding: &crate::data_figures::section::Finding| {
        format!("{}: {}.", finding.chapter, finding.here)
    };
    section.findings.iter().map(sentence).collect()
}
