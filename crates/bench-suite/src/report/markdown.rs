//! The report as one Markdown page: one sentence a line, generated parts fenced by the command that made them.

use super::text_table::TextTable;

/// A Markdown page under construction.
#[derive(Debug, Default)]
pub struct Page {
    parts: Vec<String>,
}

impl Page {
    /// Page with a title.
    pub fn titled(title: &str) -> Self {
        Self {
            parts: vec![format!(
                "# {title}
"
            )],
        }
    }

    /// Heading of a section.
    pub fn section(&mut self, title: &str) {
        self.parts.push(format!("\n## {title}\n"));
    }

    /// Sentences as they are, one a line.
    pub fn prose(&mut self, text: &str) {
        self.parts.push(format!("\n{}\n", text.trim()));
    }

    /// A list, or a sentence when it is empty.
    pub fn list(&mut self, items: &[String], when_empty: &str) {
        if items.is_empty() {
            return self.prose(when_empty);
        }
        self.parts.push("\n".to_string());
        for item in items {
            self.parts.push(format!("- {item}\n"));
        }
    }

    /// A table.
    pub fn table(&mut self, table: &TextTable) {
        self.parts.push(format!("\n{}", table.to_markdown()));
    }

    /// A picture in the same directory.
    pub fn picture(&mut self, caption: &str, file: &str) {
        self.parts.push(format!("\n![{caption}]({file})\n"));
    }

    /// A command that can be copied.
    pub fn command(&mut self, command: &str) {
        self.parts.push(format!("\n```text\n{command}\n```\n"));
    }

    /// The page.
    pub fn into_text(self) -> String {
        self.parts.concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_empty_list_says_so() {
        let mut page = Page::titled("T");
        page.section("S");
        page.list(&[], "None.");
        page.list(&["a.".into()], "None.");
        assert_eq!(page.into_text(), "# T\n\n## S\n\nNone.\n\n- a.\n");
    }
}
