//! What a figure or table about the data contributes to the report: files, a picture, a table, and claims beside findings.

use std::path::Path;

use crate::error::BenchError;
use crate::figure::picture::Picture;
pub use crate::report::finding::Finding;
use crate::report::page::Page;
use crate::report::text_table::TextTable;

/// One section of the report.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// Names and contents of the files, pictures included.
    pub files: Vec<(String, Vec<u8>)>,
    /// Caption and file of the picture, if there is one.
    pub picture: Option<(String, String)>,
    /// Table to show, if there is one.
    pub table: Option<TextTable>,
    /// The chapter's statements beside ours.
    pub findings: Vec<Finding>,
}

/// A section, if all the work behind it is there.
pub type Made = Result<Option<Section>, BenchError>;

impl Section {
    /// A section that shows a table.
    pub fn of_table(table: TextTable) -> Self {
        Self {
            table: Some(table),
            ..Self::default()
        }
    }

    /// Adds a file.
    pub fn file(&mut self, name: &str, contents: impl Into<Vec<u8>>) {
        self.files.push((name.to_string(), contents.into()));
    }

    /// Adds `name.svg` and `name.png`, and shows the latter.
    ///
    /// # Errors
    /// `Picture` if it cannot be drawn.
    pub fn show(&mut self, name: &str, caption: &str, picture: &Picture) -> Result<(), BenchError> {
        self.file(&format!("{name}.svg"), picture.to_svg());
        self.file(&format!("{name}.png"), picture.to_png()?);
        self.picture = Some((caption.to_string(), format!("{name}.png")));
        Ok(())
    }

    /// The CSV files and their columns.
    pub fn tables(&self) -> impl Iterator<Item = (&str, String)> {
        let columns = |contents: &[u8]| {
            let header = contents.split(|byte| *byte == b'\n').next();
            String::from_utf8_lossy(header.unwrap_or_default()).replace(',', ", ")
        };
        let is_csv = |name: &str| Path::new(name).extension().is_some_and(|e| e == "csv");
        let files = self.files.iter().filter(move |(name, _)| is_csv(name));
        files.map(move |(name, contents)| (name.as_str(), columns(contents)))
    }

    /// Adds title, picture, table and where the rows are to a page.
    pub fn put_on(&self, page: &mut Page, title: &str) {
        page.section(title);
        if let Some((caption, file)) = &self.picture {
            page.picture(caption, file);
        }
        if let Some(table) = &self.table {
            page.table(table);
        }
        for (file, columns) in self.tables() {
            page.rows(file, &columns);
        }
    }

    /// Adds a statement and what was found.
    pub fn found(&mut self, chapter: impl Into<String>, here: impl Into<String>) {
        self.findings.push(Finding::new(chapter, here));
    }
}

/// CSV text: a header and rows of labels and numbers, each number with all its digits.
pub fn csv(header: &str, rows: impl IntoIterator<Item = (Vec<String>, Vec<f64>)>) -> String {
    let mut text = format!("{header}\n");
    for (labels, numbers) in rows {
        let numbers = numbers.into_iter().map(|number| format!("{number:e}"));
        let row: Vec<String> = labels.into_iter().chain(numbers).collect();
        text.push_str(&row.join(","));
        text.push('\n');
    }
    text
}

/// Smallest and largest number.
pub fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    let widen = |(low, high): (f64, f64), value: f64| (low.min(value), high.max(value));
    values.into_iter().fold(start, widen)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_csv_keep_every_bit() {
        let number = 0.1 + 0.2;
        let text = csv("name,value", [(vec!["a".to_string()], vec![number])]);
        let last = text.trim_end().rsplit(',').next().unwrap();
        assert_eq!(last.parse::<f64>().unwrap().to_bits(), number.to_bits());
        assert!(text.starts_with("name,value\na,"), "{text}");
    }

    #[test]
    fn extent_worked_by_hand() {
        assert_eq!(extent([2.0, -1.0, 0.5]), (-1.0, 2.0));
    }
}
