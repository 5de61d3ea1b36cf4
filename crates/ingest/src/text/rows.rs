//! The rows of a text file, with counts checked at the end.

use super::dialect::Dialect;
use crate::assemble::{Batch, Numbers};
use crate::blocks::Blocks;
use crate::damages::Damages;
use crate::scan::Rows;
use crate::table::{self, RowFormat};
use crate::{Error, Notes};
use timberline_pointcloud::Column;

/// Reads the rows of one text file.
pub(crate) struct TextRows {
    blocks: Blocks,
    format: RowFormat,
    /// Lines before the next block.
    line: u64,
    /// Points that lines promise, and the first such line, from 1.
    promised: Option<(u64, u64)>,
    rows: u64,
    longer: u64,
    no_numbers: u64,
    doubled: Option<usize>,
    ended: bool,
}

impl TextRows {
    /// `doubled`: a column that comes once more, last.
    pub(crate) fn new(
        blocks: Blocks,
        format: RowFormat,
        dialect: &Dialect,
        doubled: Option<usize>,
    ) -> Self {
        Self {
            blocks,
            format,
            line: dialect.data_line,
            promised: dialect.count,
            rows: 0,
            longer: 0,
            no_numbers: 0,
            doubled,
            ended: false,
        }
    }

    fn batch(&mut self, found: table::Rows) -> Batch {
        let mut columns: Vec<Column> = found.columns.into_iter().map(Column::F64).collect();
        if let Some(column) = self.doubled.and_then(|index| columns.get(index).cloned()) {
            columns.push(column);
        }
        let numbers = found.lines.into_iter().map(|line| line + self.line + 1).collect();
        Batch { columns, noun: "line".to_owned(), numbers: Numbers::Each(numbers), source_id: 0 }
    }

    fn note(&mut self, found: &table::Rows, damages: &mut Damages) {
        note_faults(found, self.line, damages);
        for (line, count) in &found.counts {
            let first = self.promised.map_or(line + self.line + 1, |(_, line)| line);
            let before = self.promised.map_or(0, |(count, _)| count);
            self.promised = Some((before.saturating_add(*count), first));
        }
        self.rows += found.len();
        self.longer += found.longer;
        self.no_numbers += found.no_numbers;
    }

    /// What can be said only after the last row.
    fn end(&mut self, damages: &mut Damages, notes: &mut Notes) {
        let rows = self.rows;
        match self.promised {
            Some((count, line)) if count > rows => damages.add(
                format!("line {line}"),
                format!("it counts {count} points, the file has {rows}"),
                count - rows,
            ),
            Some((count, line)) if count < rows => {
                notes.say(format!("line {line} counts {count} points, the file has {rows}"));
            }
            _ => {}
        }
        if self.longer > 0 {
            let expected = self.format.fields.len();
            notes.say(format!(
                "{} lines have more than {expected} columns: what is more is left out",
                self.longer
            ));
        }
        if self.no_numbers > 0 {
            let count = self.no_numbers;
            notes.say(format!("{count} values after x, y, z are no numbers and count as missing"));
        }
        self.ended = true;
    }
}

/// Rows that cannot be used, by their lines.
pub(crate) fn note_faults(found: &table::Rows, line: u64, damages: &mut Damages) {
    let told = found.faults.len() as u64;
    for (index, (at, problem)) in found.faults.iter().enumerate() {
        let rest = if index as u64 + 1 == told { found.faulty - told } else { 0 };
        damages.add(format!("line {}", at + line + 1), problem.clone(), 1 + rest);
    }
}

impl Rows for TextRows {
    fn next(&mut self, damages: &mut Damages, notes: &mut Notes) -> Result<Option<Batch>, Error> {
        if self.ended {
            return Ok(None);
        }
        let Some(block) = self.blocks.next()? else {
            self.end(damages, notes);
            return Ok(None);
        };
        let found = self.format.rows(&block);
        self.note(&found, damages);
        let lines = found.line_count;
        let batch = self.batch(found);
        self.line += lines;
        Ok(Some(batch))
    }
}
