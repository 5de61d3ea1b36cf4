//! Writing to stdout and stderr.

use serde::Serialize;
use std::io::{IsTerminal, Write};

/// Writes bytes to stdout. A reader that went away is no error (`| head`).
pub fn raw(bytes: &[u8]) {
    let _ = std::io::stdout().write_all(bytes);
}

/// A line of results.
pub fn line(text: &str) {
    raw(format!("{text}\n").as_bytes());
}

/// Results for a program.
///
/// # Errors
/// When the value has no JSON form.
pub fn json(value: &impl Serialize) -> anyhow::Result<()> {
    line(&serde_json::to_string_pretty(value)?);
    Ok(())
}

/// A line of talk.
pub fn talk(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// An error.
pub fn error(text: &str) {
    let word = if colours() { "\u{1b}[1;31merror\u{1b}[0m" } else { "error" };
    talk(&format!("{word}: {text}"));
}

fn colours() -> bool {
    std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty())
        && std::io::stderr().is_terminal()
}

/// A table: first column to the left, the others to the right unless they are the last.
#[derive(Debug, Default)]
pub struct Table {
    rows: Vec<Vec<String>>,
    last_is_text: bool,
}

impl Table {
    /// A table with a heading.
    #[must_use]
    pub fn new(heading: &[&str]) -> Self {
        Self {
            rows: vec![heading.iter().map(|&cell| cell.to_owned()).collect()],
            last_is_text: false,
        }
    }

    /// The last column is prose.
    #[must_use]
    pub fn with_text(mut self) -> Self {
        self.last_is_text = true;
        self
    }

    /// Adds a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// The table as text, without a last line end.
    #[must_use]
    pub fn text(&self) -> String {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        let lines: Vec<String> = self.rows.iter().map(|row| self.line(row, &widths)).collect();
        lines.join("\n")
    }

    fn line(&self, row: &[String], widths: &[usize]) -> String {
        let mut text = String::new();
        for (column, cell) in row.iter().enumerate() {
            let left = column == 0 || (self.last_is_text && column + 1 == widths.len());
            let gap = " ".repeat(widths[column].saturating_sub(cell.chars().count()));
            let padded = if left { format!("{cell}{gap}") } else { format!("{gap}{cell}") };
            text.push_str(if column > 0 { "  " } else { "" });
            text.push_str(&padded);
        }
        text.trim_end().to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::Table;

    #[test]
    fn tables_line_up() {
        let mut table = Table::new(&["stage", "n", "why"]).with_text();
        table.row(["dtm".into(), "12".into(), "x".into()]);
        assert_eq!(table.text(), "stage   n  why\ndtm    12  x");
    }
}
