//! The sections of the report about the data.

use super::samples::Samples;
use super::spec::DataExperiment;
use super::{make, section::Section};
use crate::error::BenchError;
use crate::report::page::Page;

/// Sections of the experiments, each with its description.
///
/// # Errors
/// Those of [`Samples::reference`] and [`make`].
pub fn sections(
    experiments: &[DataExperiment],
) -> Result<Vec<(&DataExperiment, Section)>, BenchError> {
    if experiments.is_empty() {
        return Ok(Vec::new());
    }
    let samples = Samples::reference()?;
    experiments
        .iter()
        .map(|experiment| Ok((experiment, make(&experiment.name, &samples)?)))
        .collect()
}

/// Adds one section to the page: picture, table, claims beside findings, and how to read it.
pub fn write(page: &mut Page, experiment: &DataExperiment, section: &Section) {
    section.put_on(page, &experiment.title);
    page.claims(&section.findings);
    page.prose(&experiment.text.analysis);
}

/// The findings as sentences for the terminal.
pub fn sentences(section: &Section) -> Vec<String> {
    let sentence = |finding: &super::section::Finding| {
        format!("chapter: {}; here: {}.", finding.chapter, finding.here)
    };
    section.findings.iter().map(sentence).collect()
}
