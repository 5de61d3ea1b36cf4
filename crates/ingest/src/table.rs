//! Rows of numbers as text, into columns.

use crate::blocks::pieces;
use rayon::prelude::*;

/// Bytes that one thread parses at a time.
const PIECE_BYTES: usize = 1 << 17;
/// Faults told of one piece; more are counted.
const MAX_FAULTS: usize = 32;
/// Characters of a row or value shown in messages.
const SHOWN: usize = 40;

/// What stands between values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Separator {
    /// Any number of blanks and tabs.
    Blanks,
    /// One such character, with blanks around it.
    Char(u8),
}

/// A value of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Field {
    /// Goes to that column. A value that is no number is a fault if it is `needed`, else NaN.
    Value { column: usize, needed: bool },
    /// Not read.
    Skip,
    /// A number of values (PLY's lists), then so many values; not read.
    List,
}

/// How rows are written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct RowFormat {
    pub(crate) separator: Separator,
    pub(crate) decimal_comma: bool,
    pub(crate) newline: u8,
    pub(crate) fields: Vec<Field>,
    pub(crate) columns: usize,
    /// Whether lines may be comments, and whole numbers alone counts of points (PTS).
    pub(crate) free: bool,
}

/// What a block of lines holds.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Rows {
    pub(crate) columns: Vec<Vec<f64>>,
    /// Line of each row, from 0.
    pub(crate) lines: Vec<u64>,
    /// Rows that cannot be used: line, and what is wrong.
    pub(crate) faults: Vec<(u64, String)>,
    /// All rows that cannot be used.
    pub(crate) faulty: u64,
    /// Lines that are no rows.
    pub(crate) others: Vec<u64>,
    /// Lines that count points, and their counts.
    pub(crate) counts: Vec<(u64, u64)>,
    /// Values that are no numbers and not needed.
    pub(crate) no_numbers: u64,
    /// Rows with more values than there are fields.
    pub(crate) longer: u64,
    /// Number of lines.
    pub(crate) line_count: u64,
}

impl RowFormat {
    /// Reads all rows of a block of whole lines, in parallel; the sequence is that of the lines.
    pub(crate) fn rows(&self, block: &[u8]) -> Rows {
        let pieces = pieces(block, self.newline, PIECE_BYTES);
        let parts: Vec<Rows> = pieces.into_par_iter().map(|piece| self.piece(piece)).collect();
        let mut all = Rows { columns: vec![Vec::new(); self.columns], ..Rows::default() };
        parts.into_iter().for_each(|part| all.append(part));
        all
    }

    fn piece(&self, bytes: &[u8]) -> Rows {
        let room = bytes.len() / (8 * self.fields.len().max(1)) + 1;
        let columns = (0..self.columns).map(|_| Vec::with_capacity(room)).collect();
        let mut rows = Rows { columns, lines: Vec::with_capacity(room), ..Rows::default() };
        let body = bytes.strip_suffix(&[self.newline]).unwrap_or(bytes);
        for line in body.split(|byte| *byte == self.newline) {
            self.line(line, &mut rows);
            rows.line_count += 1;
        }
        rows
    }

    fn line(&self, line: &[u8], rows: &mut Rows) {
        let line = line.trim_ascii();
        if line.is_empty() || (self.free && is_comment(line)) {
            rows.others.push(rows.line_count);
            return;
        }
        let row = rows.lines.len();
        match self.row(line, rows) {
            Ok(()) => rows.lines.push(rows.line_count),
            Err(problem) => {
                rows.columns.iter_mut().for_each(|column| column.truncate(row));
                if let Some(count) = whole_number(line).filter(|_| self.free) {
                    rows.counts.push((rows.line_count, count));
                    rows.others.push(rows.line_count);
                    return;
                }
                rows.faulty += 1;
                if rows.faults.len() < MAX_FAULTS {
                    rows.faults.push((rows.line_count, problem));
                }
            }
        }
    }

    fn row(&self, line: &[u8], rows: &mut Rows) -> Result<(), String> {
        let mut values = Values { rest: line, separator: self.separator };
        for (index, field) in self.fields.iter().enumerate() {
            let value = values.next().ok_or_else(|| self.too_few(index, line))?;
            match *field {
                Field::Skip => {}
                Field::Value { column, needed } => {
                    let number = number(value, self.decimal_comma);
                    if number.is_none() {
                        if needed {
                            return Err(format!("`{}` is no number", shown(value)));
                        }
                        rows.no_numbers += 1;
                    }
                    rows.columns[column].push(number.unwrap_or(f64::NAN));
                }
                Field::List => {
                    let count = whole_number(value);
                    let count = count.ok_or_else(|| format!("`{}` is no count", shown(value)))?;
                    for _ in 0..count {
                        values.next().ok_or_else(|| self.too_few(index, line))?;
                    }
                }
            }
        }
        rows.longer += u64::from(values.next().is_some());
        Ok(())
    }

    fn too_few(&self, found: usize, line: &[u8]) -> String {
        format!("{found} columns, expected {}: `{}`", self.fields.len(), shown(line))
    }
}

impl Rows {
    fn append(&mut self, part: Rows) {
        let from = self.line_count;
        for (all, column) in self.columns.iter_mut().zip(part.columns) {
            if all.is_empty() { *all = column } else { all.extend(column) }
        }
        self.lines.extend(part.lines.into_iter().map(|line| line + from));
        self.faults.extend(part.faults.into_iter().map(|(line, problem)| (line + from, problem)));
        self.others.extend(part.others.into_iter().map(|line| line + from));
        self.counts.extend(part.counts.into_iter().map(|(line, count)| (line + from, count)));
        self.faulty += part.faulty;
        self.no_numbers += part.no_numbers;
        self.longer += part.longer;
        self.line_count += part.line_count;
    }

    /// Number of rows, those with faults included.
    pub(crate) fn len(&self) -> u64 {
        self.lines.len() as u64 + self.faulty
    }

    /// Keeps the first so many rows, those with faults included.
    pub(crate) fn truncate(&mut self, rows: u64) {
        if self.len() <= rows {
            return;
        }
        let mut end = rows;
        for line in &self.others {
            if *line > end {
                break;
            }
            end += 1;
        }
        let kept = self.lines.partition_point(|line| *line < end);
        self.lines.truncate(kept);
        self.columns.iter_mut().for_each(|column| column.truncate(kept));
        self.faults.retain(|(line, _)| *line < end);
        self.faulty = rows.saturating_sub(kept as u64);
    }
}

/// The values of a row.
pub(crate) struct Values<'a> {
    pub(crate) rest: &'a [u8],
    pub(crate) separator: Separator,
}

impl<'a> Iterator for Values<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        match self.separator {
            Separator::Blanks => {
                self.rest = self.rest.trim_ascii_start();
                if self.rest.is_empty() {
                    return None;
                }
                let end = self.rest.iter().position(|byte| matches!(byte, b' ' | b'\t' | b'\r'));
                let (value, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
                self.rest = rest;
                Some(value)
            }
            Separator::Char(separator) => {
                if self.rest.is_empty() {
                    return None;
                }
                let end = self.rest.iter().position(|byte| *byte == separator);
                let (value, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
                self.rest = rest.get(1..).unwrap_or_default();
                Some(value.trim_ascii())
            }
        }
    }
}

/// A number, with a decimal point or, where that is how the file is written, a comma.
pub(crate) fn number(value: &[u8], decimal_comma: bool) -> Option<f64> {
    const LONGEST: usize = 64;
    if let Ok(number) = fast_float2::parse::<f64, _>(value)
        && !(decimal_comma && value.contains(&b'.'))
    {
        return Some(number);
    }
    if let Some(inner) = value.strip_prefix(b"\"").and_then(|value| value.strip_suffix(b"\"")) {
        return number(inner.trim_ascii(), decimal_comma);
    }
    if !decimal_comma || value.len() > LONGEST || value.contains(&b'.') {
        return None;
    }
    let mut with_point = [0; LONGEST];
    let with_point = &mut with_point[..value.len()];
    with_point.copy_from_slice(value);
    let comma = with_point.iter().position(|byte| *byte == b',')?;
    let is_digit =
        |at: Option<usize>| at.and_then(|at| value.get(at)).is_some_and(u8::is_ascii_digit);
    // Between two digits: in `1, 2, 3` it is the separator.
    if !(is_digit(comma.checked_sub(1)) && is_digit(Some(comma + 1))) {
        return None;
    }
    with_point[comma] = b'.';
    fast_float2::parse(with_point).ok()
}

/// A number of digits only.
pub(crate) fn whole_number(value: &[u8]) -> Option<u64> {
    std::str::from_utf8(value.trim_ascii()).ok()?.parse().ok()
}

/// Whether a line (without blanks around it) is a comment.
pub(crate) fn is_comment(line: &[u8]) -> bool {
    line.starts_with(b"//") || matches!(line.first(), Some(b'#' | b'%' | b'!'))
}

/// The beginning of a row or value, for messages.
pub(crate) fn shown(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(SHOWN)]);
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if bytes.len() > SHOWN { format!("{text}...") } else { text }
}

#[cfg(test)]
mod tests;
