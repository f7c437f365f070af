//! The report as a description: headings, sentences, tables, pictures, claims, and where the rows behind them are.
//!
//! [`markdown`](super::markdown) and [`html`](super::html) write it down.

use super::finding::Finding;
use super::text_table::TextTable;

/// One block of the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Block {
    /// Heading of a part, which has sections.
    Part(String),
    /// Heading of a section.
    Section(String),
    /// Sentences in Markdown, one a line.
    Prose(String),
    /// Items in Markdown; an item may have a nested list.
    List(Vec<String>),
    /// A table.
    Table(TextTable),
    /// A table whose columns called `ratio` hold ours divided by the published value.
    Compared(TextTable),
    /// What the chapter claims beside what was found.
    Claims(Vec<Finding>),
    /// A picture among the report's files.
    Picture {
        /// What it shows.
        caption: String,
        /// Its PNG file; the SVG file has the same stem.
        png: String,
    },
    /// A command that can be copied.
    Command(String),
    /// Where the rows behind the last table or picture are.
    Rows {
        /// A CSV file of the report.
        file: String,
        /// The columns that find a row, separated by a comma and a blank.
        key: String,
    },
}

/// A page under construction.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Page {
    title: String,
    blocks: Vec<Block>,
}

impl Page {
    /// Page with a title.
    pub fn titled(title: &str) -> Self {
        Self {
            title: title.to_string(),
            blocks: Vec::new(),
        }
    }

    /// The title.
    pub fn title(&self) -> &str {
        &self.title
    }

    /// The blocks in their order.
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Heading of a part.
    pub fn part(&mut self, title: &str) {
        self.blocks.push(Block::Part(title.to_string()));
    }

    /// Heading of a section.
    pub fn section(&mut self, title: &str) {
        self.blocks.push(Block::Section(title.to_string()));
    }

    /// Sentences as they are, one a line.
    pub fn prose(&mut self, text: &str) {
        self.blocks.push(Block::Prose(text.trim().to_string()));
    }

    /// A list, or a sentence when it is empty.
    pub fn list(&mut self, items: &[String], when_empty: &str) {
        if items.is_empty() {
            return self.prose(when_empty);
        }
        self.blocks.push(Block::List(items.to_vec()));
    }

    /// A table.
    pub fn table(&mut self, table: &TextTable) {
        self.blocks.push(Block::Table(table.clone()));
    }

    /// A table with published values, whose columns called `ratio` hold ours divided by them.
    pub fn compared(&mut self, table: &TextTable) {
        self.blocks.push(Block::Compared(table.clone()));
    }

    /// What the chapter claims beside what was found.
    pub fn claims(&mut self, claims: &[Finding]) {
        if !claims.is_empty() {
            self.blocks.push(Block::Claims(claims.to_vec()));
        }
    }

    /// A picture in the same directory: its PNG file, beside which is an SVG file.
    pub fn picture(&mut self, caption: &str, png: &str) {
        self.blocks.push(Block::Picture {
            caption: caption.to_string(),
            png: png.to_string(),
        });
    }

    /// A command that can be copied.
    pub fn command(&mut self, command: &str) {
        self.blocks.push(Block::Command(command.to_string()));
    }

    /// Where the rows behind what was shown last are: a CSV file and the columns that find a row in it.
    pub fn rows(&mut self, file: &str, key: &str) {
        self.blocks.push(Block::Rows {
            file: file.to_string(),
            key: key.to_string(),
        });
    }

    /// A Markdown document with one title as a part of this page: its sections become this page's.
    pub fn document(&mut self, text: &str) {
        let mut prose = Vec::new();
        for line in text.lines() {
            let heading = line.strip_prefix("# ").map(|title| (true, title));
            match heading.or_else(|| line.strip_prefix("## ").map(|title| (false, title))) {
                Some((is_part, title)) => {
                    self.prose_unless_empty(&mut prose);
                    if is_part {
                        self.part(title);
                    } else {
                        self.section(title);
                    }
                }
                None => prose.push(line),
            }
        }
        self.prose_unless_empty(&mut prose);
    }

    fn prose_unless_empty(&mut self, lines: &mut Vec<&str>) {
        let text = std::mem::take(lines).join("\n");
        if !text.trim().is_empty() {
            self.prose(&text);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_list_says_so() {
        let mut page = Page::titled("T");
        page.list(&[], "None.");
        assert_eq!(page.blocks(), [Block::Prose("None.".into())]);
    }

    #[test]
    fn a_document_becomes_a_part_with_its_sections() {
        let mut page = Page::titled("T");
        page.document("# D\n\nOne.\n\n## S\n| a |\n| --- |\n| # b |\n");
        let expected = [
            Block::Part("D".into()),
            Block::Prose("One.".into()),
            Block::Section("S".into()),
            Block::Prose("| a |\n| --- |\n| # b |".into()),
        ];
        assert_eq!(page.blocks(), expected);
    }
}
