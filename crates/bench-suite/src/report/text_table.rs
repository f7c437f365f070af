//! One table as aligned plain text and as Markdown.

/// A table of strings; every row as long as the header.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct TextTable {
    /// Column titles.
    pub header: Vec<String>,
    /// Rows.
    pub rows: Vec<Vec<String>>,
    /// Number of leading columns that are aligned left; the others are numbers and aligned right.
    pub n_left: usize,
}

impl TextTable {
    /// Table whose first `n_left` columns are aligned left.
    pub fn new(
        n_left: usize,
        header: impl IntoIterator<Item = impl Into<String>>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        Self {
            header: header.into_iter().map(Into::into).collect(),
            rows: rows.into_iter().collect(),
            n_left,
        }
    }

    /// Columns separated by two blanks, no trailing blanks.
    pub fn to_text(&self) -> String {
        let widths = self.widths();
        let line = |row: &Vec<String>| {
            let cells = row.iter().zip(&widths).enumerate();
            let cells: Vec<String> = cells
                .map(|(i, (cell, &width))| self.pad(i, cell, width))
                .collect();
            cells.join("  ").trim_end().to_string() + "\n"
        };
        std::iter::once(&self.header)
            .chain(&self.rows)
            .map(line)
            .collect()
    }

    /// Pipe table.
    pub fn to_markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rule: Vec<String> = (0..self.header.len())
            .map(|i| if i < self.n_left { "---" } else { "---:" }.to_string())
            .collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        line(&self.header) + &line(&rule) + &rows
    }

    fn widths(&self) -> Vec<usize> {
        (0..self.header.len())
            .map(|i| {
                let column = self.rows.iter().map(|row| &row[i]);
                let widths = column
                    .chain([&self.header[i]])
                    .map(|cell| cell.chars().count());
                widths.max().unwrap_or(0)
            })
            .collect()
    }

    fn pad(&self, column: usize, cell: &str, width: usize) -> String {
        if column < self.n_left {
            format!("{cell:<width$}")
        } else {
            format!("{cell:>width$}")
        }
    }
}

/// Two significant figures, as in 3.4e-7; a dash for a missing value.
pub fn score(value: Option<f64>) -> String {
    value.map_or_else(dash, |v| format!("{v:.1e}"))
}

/// One significant figure, as the chapter prints; a dash for a missing value.
pub fn printed_score(value: Option<f64>) -> String {
    value.map_or_else(dash, |v| format!("{v:.0e}"))
}

/// A ratio to two significant figures, without an exponent while that stays short.
pub fn ratio(value: Option<f64>) -> String {
    value.map_or_else(dash, |v| match v {
        v if (0.0995..9.95).contains(&v) => format!("{v:.2}"),
        v if (9.95..9999.5).contains(&v) => format!("{v:.0}"),
        v => format!("{v:.1e}"),
    })
}

fn dash() -> String {
    "–".to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_line_up_and_nothing_trails() {
        let rows = [["LR¬c", "1"], ["a", "10.25"]].map(|row| row.map(String::from).to_vec());
        let table = TextTable::new(1, ["model", "nMSE"], rows);
        assert_eq!(
            table.to_text(),
            "model   nMSE\nLR¬c       1\na      10.25\n"
        );
        assert_eq!(
            table.to_markdown(),
            "| model | nMSE |\n| --- | ---: |\n| LR¬c | 1 |\n| a | 10.25 |\n"
        );
    }

    #[test]
    fn numbers_keep_two_figures() {
        assert_eq!(score(Some(3.44e-7)), "3.4e-7");
        assert_eq!(printed_score(Some(9e-10)), "9e-10");
        assert_eq!(ratio(Some(0.954)), "0.95");
        assert_eq!(ratio(Some(12.6)), "13");
        assert_eq!(ratio(Some(0.012)), "1.2e-2");
        assert_eq!(score(None), "–");
    }
}
