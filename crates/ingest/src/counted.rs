//! Rows of text of which a header says how many there are (ASCII PLY and PCD).

use crate::assemble::{Batch, Numbers};
use crate::blocks::Blocks;
use crate::damages::Damages;
use crate::scan::Rows;
use crate::table::RowFormat;
use crate::text::note_faults;
use crate::{Error, Notes};
use timberline_pointcloud::Column;

/// What is done to the columns of a batch before they are handed on.
type Finish = Box<dyn Fn(&mut Vec<Column>)>;

/// Reads so many rows, one a line.
pub(crate) struct CountedRows {
    blocks: Blocks,
    format: RowFormat,
    /// Lines before the next block.
    line: u64,
    /// Rows to step over before the first.
    before: u64,
    left: u64,
    count: u64,
    finish: Option<Finish>,
}

impl CountedRows {
    /// Rows that begin after so many lines of header.
    pub(crate) fn new(blocks: Blocks, format: RowFormat, lines: u64, count: u64) -> Self {
        Self { blocks, format, line: lines, before: 0, left: count, count, finish: None }
    }

    /// Steps over so many lines first.
    pub(crate) fn after(mut self, lines: u64) -> Self {
        self.before = lines;
        self
    }

    /// Gives a column once more, last.
    pub(crate) fn doubling(self, column: Option<usize>) -> Self {
        match column {
            Some(column) => {
                self.finishing(Box::new(move |columns| columns.push(columns[column].clone())))
            }
            None => self,
        }
    }

    /// Does something to the columns of every batch, after what was asked for before.
    pub(crate) fn finishing(mut self, then: Finish) -> Self {
        self.finish = Some(match self.finish.take() {
            None => then,
            Some(first) => Box::new(move |columns| {
                first(columns);
                then(columns);
            }),
        });
        self
    }

    /// Steps over lines of other things; the rest of the block.
    fn skip_before<'a>(&mut self, block: &'a [u8]) -> &'a [u8] {
        let mut rest = block;
        while self.before > 0 && !rest.is_empty() {
            let end = rest.iter().position(|byte| *byte == self.format.newline);
            let (line, after) = rest.split_at(end.map_or(rest.len(), |end| end + 1));
            self.before -= u64::from(!line.trim_ascii().is_empty());
            self.line += 1;
            rest = after;
        }
        rest
    }

    fn end(&mut self, damages: &mut Damages) {
        let found = self.count - self.left;
        let problem = format!("the file ends after {found} of {} records", self.count);
        damages.add(format!("line {}", self.line), problem, self.left);
        self.left = 0;
    }
}

impl Rows for CountedRows {
    fn next(&mut self, damages: &mut Damages, notes: &mut Notes) -> Result<Option<Batch>, Error> {
        if self.left == 0 {
            return Ok(None);
        }
        let Some(block) = self.blocks.next()? else {
            self.end(damages);
            return Ok(None);
        };
        let block = self.skip_before(&block);
        let mut rows = self.format.rows(block);
        let line_count = rows.line_count;
        rows.truncate(self.left);
        self.left -= rows.len();
        note_faults(&rows, self.line, damages);
        if rows.no_numbers > 0 {
            notes.say("some values after x, y, z are no numbers and count as missing");
        }
        let mut columns: Vec<Column> = rows.columns.into_iter().map(Column::F64).collect();
        if let Some(finish) = &self.finish {
            finish(&mut columns);
        }
        let numbers = rows.lines.into_iter().map(|line| line + self.line + 1).collect();
        self.line += line_count;
        let numbers = Numbers::Each(numbers);
        Ok(Some(Batch { columns, noun: "line".to_owned(), numbers, source_id: 0 }))
    }
}
