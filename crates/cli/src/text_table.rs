//! Small tables for people: columns as wide as their longest entry, names left, values right.

/// The lines of a table.
///
/// # Panics
/// If a row has more entries than the header.
pub fn render(header: &[&str], rows: &[Vec<String>]) -> String {
    let length = |text: &str| text.chars().count();
    let width = |col: usize| {
        let entries = rows.iter().map(|row| length(&row[col]));
        entries.chain([length(header[col])]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let line = |entries: Vec<&str>| {
        let padded: Vec<String> = entries
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(col, (entry, &width))| {
                let blanks = " ".repeat(width - length(entry));
                if col == 0 {
                    format!("{entry}{blanks}")
                } else {
                    format!("{blanks}{entry}")
                }
            })
            .collect();
        format!("{}\n", padded.join("  ").trim_end())
    };
    std::iter::once(line(header.to_vec()))
        .chain(
            rows.iter()
                .map(|row| line(row.iter().map(String::as_str).collect())),
        )
        .collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn columns_are_as_wide_as_their_longest_entry() {
        let rows = [
            vec!["joint1".to_owned(), "½".to_owned()],
            vec!["b".to_owned(), "2.25".to_owned()],
        ];
        assert_eq!(
            super::render(&["joint", "N·m"], &rows),
            "joint    N·m\njoint1     ½\nb       2.25\n"
        );
    }
}
