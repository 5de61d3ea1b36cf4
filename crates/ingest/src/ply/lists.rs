//! Binary PLY elements with lists: records of different lengths, read one after the other.

use super::header::{Element, Encoding, Header, Property};
use crate::assemble::{Batch, Numbers};
use crate::damages::Damages;
use crate::extra::{Raw, Stored};
use crate::records::column;
use crate::scan::Rows;
use crate::source::Source;
use crate::text::Range;
use crate::{Error, Notes};
use timberline_pointcloud::Column;

/// Records in a batch.
const BATCH: u64 = 1 << 17;
/// Bytes read at once.
const BUFFER: u64 = 1 << 18;
/// Records from which ranges are sampled: the first.
const SAMPLES: u64 = 4096;

/// Where the data of an element begin: what comes before is stepped over.
///
/// # Errors
/// [`Error::Content`] when the file ends before, [`Error::Io`].
pub(super) fn skip(source: &mut dyn Source, header: &Header, index: usize) -> Result<u64, Error> {
    let big = header.encoding == Encoding::Big;
    let mut bytes = Bytes::new(header.data_at, source.byte_len()?);
    for element in &header.elements[..index] {
        match element.record_len() {
            Some(len) => {
                bytes.at = bytes.at.saturating_add(element.count.saturating_mul(len as u64));
            }
            None => {
                for _ in 0..element.count {
                    if bytes.record(source, element, big, &mut |_, _| {})?.is_none() {
                        return Err(too_short(&bytes, element));
                    }
                }
            }
        }
        if bytes.at > bytes.end {
            return Err(too_short(&bytes, element));
        }
    }
    Ok(bytes.at)
}

fn too_short(bytes: &Bytes, element: &Element) -> Error {
    Error::Content {
        place: format!("element `{}`", element.name),
        problem: format!(
            "the file ends at byte {} before its {} records",
            bytes.end, element.count
        ),
        remedy: "get the file again from its supplier",
    }
}

/// Ranges of the values of the first records.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn sample(
    source: &mut dyn Source,
    header: &Header,
    index: usize,
    at: u64,
    columns: usize,
) -> Result<Vec<Range>, Error> {
    let element = &header.elements[index];
    let mut ranges = vec![Range::NOTHING; columns];
    let mut bytes = Bytes::new(at, source.byte_len()?);
    for _ in 0..element.count.min(SAMPLES) {
        let mut add = |column: usize, value: f64| {
            if let Some(range) = ranges.get_mut(column) {
                range.add(Some(value));
            }
        };
        let big = header.encoding == Encoding::Big;
        if bytes.record(source, element, big, &mut add)?.is_none() {
            break;
        }
    }
    Ok(ranges)
}

/// Reads bytes forward through a buffer.
struct Bytes {
    at: u64,
    end: u64,
    buffer: Vec<u8>,
    buffer_at: u64,
}

impl Bytes {
    fn new(at: u64, end: u64) -> Self {
        Self { at, end, buffer: Vec::new(), buffer_at: at }
    }

    /// The next value; `None` at the end.
    fn value(
        &mut self,
        source: &mut dyn Source,
        stored: Stored,
        big: bool,
    ) -> Result<Option<f64>, Error> {
        let len = stored.len() as u64;
        if self.at.saturating_add(len) > self.end {
            return Ok(None);
        }
        let buffered = self.buffer_at + self.buffer.len() as u64;
        if self.at < self.buffer_at || self.at + len > buffered {
            self.buffer.resize((self.end - self.at).min(BUFFER) as usize, 0);
            source.read_at(self.at, &mut self.buffer, "records")?;
            self.buffer_at = self.at;
        }
        let from = (self.at - self.buffer_at) as usize;
        let records = &self.buffer[from..from + stored.len()];
        self.at += len;
        let raw = Raw { records, record_len: stored.len(), at: 0 };
        Ok(Some(column(raw, stored, big).value(0)))
    }

    /// Reads a record, giving its scalars by number; `None` when the file ends within it.
    fn record(
        &mut self,
        source: &mut dyn Source,
        element: &Element,
        big: bool,
        give: &mut dyn FnMut(usize, f64),
    ) -> Result<Option<()>, Error> {
        let mut scalar = 0;
        for property in &element.properties {
            match property {
                Property::Scalar { stored, .. } => {
                    let Some(value) = self.value(source, *stored, big)? else { return Ok(None) };
                    give(scalar, value);
                    scalar += 1;
                }
                Property::List { count, item } => {
                    let Some(count) = self.value(source, *count, big)? else { return Ok(None) };
                    // Negative counts are none; the cast saturates.
                    self.at =
                        self.at.saturating_add((count as u64).saturating_mul(item.len() as u64));
                    if self.at > self.end {
                        return Ok(None);
                    }
                }
            }
        }
        Ok(Some(()))
    }
}

/// Reads the records of an element with lists.
pub(super) struct ListRows {
    source: Box<dyn Source>,
    element: Element,
    big: bool,
    bytes: Bytes,
    next: u64,
    doubled: Option<usize>,
}

impl ListRows {
    pub(super) fn new(
        mut source: Box<dyn Source>,
        header: &Header,
        index: usize,
        at: u64,
        doubled: Option<usize>,
    ) -> Result<Self, Error> {
        let bytes = Bytes::new(at, source.byte_len()?);
        let (element, big) = (header.elements[index].clone(), header.encoding == Encoding::Big);
        Ok(Self { source, element, big, bytes, next: 0, doubled })
    }

    fn scalars(&self) -> usize {
        let is_scalar = |property: &&Property| matches!(property, Property::Scalar { .. });
        self.element.properties.iter().filter(is_scalar).count()
    }
}

impl Rows for ListRows {
    fn next(&mut self, damages: &mut Damages, _: &mut Notes) -> Result<Option<Batch>, Error> {
        let count = (self.element.count - self.next).min(BATCH);
        if count == 0 {
            return Ok(None);
        }
        let first = self.next;
        let mut values = vec![Vec::new(); self.scalars()];
        for done in 0..count {
            let at = self.bytes.at;
            let mut give = |column: usize, value: f64| values[column].push(value);
            let read =
                self.bytes.record(self.source.as_mut(), &self.element, self.big, &mut give)?;
            if read.is_none() {
                values.iter_mut().for_each(|column| column.truncate(done as usize));
                damages.add(
                    format!("record {} (byte {at})", first + done),
                    format!("the file ends at byte {}", self.bytes.end),
                    self.element.count - first - done,
                );
                self.next = self.element.count - count;
                break;
            }
        }
        self.next += count;
        let mut columns: Vec<Column> = values.into_iter().map(Column::F64).collect();
        columns.extend(self.doubled.map(|index| columns[index].clone()));
        let numbers = Numbers::From(first);
        Ok(Some(Batch { columns, noun: "record".to_owned(), numbers, source_id: 0 }))
    }
}
