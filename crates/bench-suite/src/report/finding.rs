//! A statement of the chapter beside what was found.

use super::text_table::TextTable;

/// A statement of the chapter and what the samples or the fits say about it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Finding {
    /// What the chapter prints.
    pub chapter: String,
    /// What was found.
    pub here: String,
}

impl Finding {
    /// A statement and what was found.
    pub fn new(chapter: impl Into<String>, here: impl Into<String>) -> Self {
        Self {
            chapter: chapter.into(),
            here: here.into(),
        }
    }
}

/// The chapter's statements and ours as a table of two columns.
pub fn side_by_side(findings: &[Finding]) -> TextTable {
    under(["the chapter", "here"], findings)
}

/// Headings with the sentences below them.
pub type Findings = Vec<(String, Vec<String>)>;

/// Findings as a table of two columns with these names.
pub fn under(header: [&str; 2], findings: &[Finding]) -> TextTable {
    let rows = findings.iter();
    TextTable::new(
        2,
        header,
        rows.map(|finding| vec![finding.chapter.clone(), finding.here.clone()]),
    )
}
