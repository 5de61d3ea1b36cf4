//! Compressed PCD data: one field after the other, each read by a decoder of its own.

use super::Wanted;
use super::header::Header;
use super::lzf::Lzf;
use crate::assemble::{Batch, Numbers};
use crate::damages::Damages;
use crate::extra::Raw;
use crate::records::column;
use crate::scan::Rows;
use crate::source::Source;
use crate::text::Range;
use crate::{Error, Notes};
use timberline_pointcloud::Column;

/// Points in a batch.
const BATCH: u64 = 1 << 17;
/// Bytes decoded at once on the way to a field.
const STEP: u64 = 1 << 16;
/// Points from which ranges are sampled: the first.
const SAMPLES: u64 = 4096;

/// The decoders of a file's fields, each standing at its field.
#[derive(Clone)]
pub(super) struct Columns {
    wanted: Vec<Wanted>,
    /// Field, bytes of one point's values in it, decoder.
    fields: Vec<(usize, usize, Lzf)>,
    /// Points of which all values can be decoded, and how many have been.
    points: u64,
    next: u64,
}

impl Columns {
    /// Steps once through the compressed data to find where the fields begin.
    ///
    /// # Errors
    /// [`Error::Content`] when the sizes are not those of the points, [`Error::Io`].
    pub(super) fn new(
        source: &mut dyn Source,
        header: &Header,
        wanted: &[Wanted],
        damages: &mut Damages,
    ) -> Result<Self, Error> {
        let wanted = wanted.to_vec();
        let mut columns = Self { wanted, fields: Vec::new(), points: header.points, next: 0 };
        if header.points == 0 {
            return Ok(columns);
        }
        let (packed, file_len) = (check_sizes(source, header)?, source.byte_len()?);
        let from = header.data_at + 8;
        let mut lzf = Lzf::new(from, from.saturating_add(packed).min(file_len));
        let mut decoded = 0;
        let mut is_whole = true;
        for (index, field) in header.fields.iter().enumerate() {
            let is_read = columns.wanted.iter().any(|w| w.field == index);
            if is_read {
                columns.fields.push((index, field.len(), lzf.bookmark()));
            }
            let bytes = field.len() as u64 * header.points;
            let found = if is_whole { skip(&mut lzf, source, bytes)? } else { 0 };
            is_whole &= found == bytes;
            decoded += found;
            if is_read {
                columns.points = columns.points.min(found / field.len().max(1) as u64);
            }
        }
        if columns.points < header.points {
            damages.add(
                format!("record {} (byte {})", columns.points, lzf.at()),
                format!("the compressed data end or are damaged after {decoded} bytes"),
                header.points - columns.points,
            );
        }
        Ok(columns)
    }

    /// Ranges of the values of the first points.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(super) fn sample(mut self, source: &mut dyn Source) -> Result<Vec<Range>, Error> {
        let columns = self.take(source, SAMPLES)?;
        let values = |column: &Column| -> Vec<f64> {
            (0..column.len()).map(|row| column.value(row)).collect()
        };
        Ok(columns.iter().map(|column| Range::of(&values(column))).collect())
    }

    /// The values of the next points.
    fn take(&mut self, source: &mut dyn Source, most: u64) -> Result<Vec<Column>, Error> {
        let count = (self.points - self.next).min(most);
        self.next += count;
        let mut data = Vec::new();
        for (field, len, lzf) in &mut self.fields {
            let mut bytes = vec![0; count as usize * *len];
            lzf.read(source, &mut bytes)?;
            data.push((*field, *len, bytes));
        }
        let of = |w: &Wanted| {
            let found = data.iter().find(|(field, _, _)| *field == w.field);
            let (len, bytes) = found.map_or((1, &[][..]), |(_, len, bytes)| (*len, bytes));
            column(Raw { records: bytes, record_len: len, at: w.value.at }, w.value.stored, false)
        };
        Ok(self.wanted.iter().map(of).collect())
    }
}

/// The compressed size; the decompressed one must be that of the points.
fn check_sizes(source: &mut dyn Source, header: &Header) -> Result<u64, Error> {
    let mut bytes = [0; 8];
    source.read_at(header.data_at, &mut bytes, "the sizes of the compressed data")?;
    let [a, b, c, d, e, f, g, h] = bytes;
    let packed = u64::from(u32::from_le_bytes([a, b, c, d]));
    let unpacked = u64::from(u32::from_le_bytes([e, f, g, h]));
    let expected = header.points.checked_mul(header.record_len as u64);
    if expected == Some(unpacked) {
        return Ok(packed);
    }
    Err(Error::Content {
        place: format!("byte {}", header.data_at + 4),
        problem: format!(
            "the data decompress to {unpacked} bytes, {} points of {} bytes are expected",
            header.points, header.record_len
        ),
        remedy: "get the file again, or save it as binary PCD",
    })
}

/// Decodes bytes nobody looks at; how many there were.
fn skip(lzf: &mut Lzf, source: &mut dyn Source, bytes: u64) -> Result<u64, Error> {
    let mut unused = vec![0; STEP as usize];
    let mut done = 0;
    while done < bytes {
        let step = (bytes - done).min(STEP) as usize;
        let found = lzf.read(source, &mut unused[..step])?;
        done += found as u64;
        if found < step {
            break;
        }
    }
    Ok(done)
}

/// Reads the points of compressed data.
pub(super) struct ColumnRows {
    source: Box<dyn Source>,
    columns: Columns,
    doubled: Option<usize>,
}

impl ColumnRows {
    /// `doubled`: a column that comes once more, last.
    pub(super) fn new(source: Box<dyn Source>, columns: Columns, doubled: Option<usize>) -> Self {
        Self { source, columns, doubled }
    }
}

impl Rows for ColumnRows {
    fn next(&mut self, _: &mut Damages, _: &mut Notes) -> Result<Option<Batch>, Error> {
        let first = self.columns.next;
        if first >= self.columns.points {
            return Ok(None);
        }
        let mut columns = self.columns.take(self.source.as_mut(), BATCH)?;
        columns.extend(self.doubled.map(|index| columns[index].clone()));
        let numbers = Numbers::From(first);
        Ok(Some(Batch { columns, noun: "record".to_owned(), numbers, source_id: 0 }))
    }
}
