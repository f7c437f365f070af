//! The report as Markdown: one sentence a line, pictures as links to the PNG files.

use super::finding;
use super::page::{Block, Page};

/// The page as text.
pub fn write(page: &Page) -> String {
    let mut text = format!("# {}\n", page.title());
    for block in page.blocks() {
        text.push('\n');
        text.push_str(&of_block(block));
    }
    text
}

/// A block, which ends with a newline.
fn of_block(block: &Block) -> String {
    match block {
        Block::Part(title) => format!("## {title}\n"),
        Block::Section(title) => format!("### {title}\n"),
        Block::Prose(text) => format!("{text}\n"),
        Block::List(items) => list(items),
        Block::Table(table) | Block::Compared(table) => table.to_markdown(),
        Block::Claims(claims) => finding::side_by_side(claims).to_markdown(),
        Block::Picture { caption, png } => format!("![{caption}]({png})\n"),
        Block::Command(command) => format!("```text\n{command}\n```\n"),
        Block::Rows { file, key } => rows(file, key) + "\n",
    }
}

/// Items as a Markdown list.
pub(super) fn list(items: &[String]) -> String {
    let lines: Vec<String> = items.iter().map(|item| format!("- {item}\n")).collect();
    lines.concat()
}

/// The sentence that says where the rows are.
pub(super) fn rows(file: &str, key: &str) -> String {
    format!("Rows: [`{file}`]({file}), columns {key}.")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_are_parted_by_blank_lines() {
        let mut page = Page::titled("T");
        page.part("P");
        page.section("S");
        page.list(&["a.".into(), "b.".into()], "None.");
        page.picture("c", "fig.png");
        page.rows("a.csv", "joint, n");
        let expected = "# T\n\n## P\n\n### S\n\n- a.\n- b.\n\n![c](fig.png)\n\nRows: [`a.csv`](a.csv), columns joint, n.\n";
        assert_eq!(write(&page), expected);
    }
}
