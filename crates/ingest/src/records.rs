//! Records of equal length with binary values, into columns (PLY, PCD).

use crate::assemble::{Batch, Numbers};
use crate::damages::Damages;
use crate::extra::{Raw, Stored};
use crate::scan::Rows;
use crate::source::Source;
use crate::text::Range;
use crate::{Error, Notes};
use timberline_pointcloud::Column;

/// Bytes of records in a batch.
const BATCH_BYTES: u64 = 1 << 23;
/// Records from which ranges are sampled.
const SAMPLES: u64 = 4096;

/// One value of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Value {
    pub(crate) stored: Stored,
    /// Byte of the record at which it begins.
    pub(crate) at: usize,
}

/// Where records stand and what is in them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Records {
    /// Byte of the first.
    pub(crate) at: u64,
    pub(crate) len: usize,
    /// How many the header promises.
    pub(crate) count: u64,
    pub(crate) big_endian: bool,
    /// Those that are read.
    pub(crate) values: Vec<Value>,
}

impl Records {
    /// How many whole records there are in a file of so many bytes.
    fn fit(&self, file_len: u64) -> u64 {
        self.count.min(file_len.saturating_sub(self.at) / self.len.max(1) as u64)
    }

    /// A value of all given records.
    fn column(&self, bytes: &[u8], value: Value) -> Column {
        column(
            Raw { records: bytes, record_len: self.len, at: value.at },
            value.stored,
            self.big_endian,
        )
    }

    /// Ranges of the values, from records all over the file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn sample(&self, source: &mut dyn Source) -> Result<Vec<Range>, Error> {
        let fit = self.fit(source.byte_len()?);
        let mut ranges = vec![Range::NOTHING; self.values.len()];
        let mut record = vec![0; self.len];
        for index in (0..fit).step_by(fit.div_ceil(SAMPLES).max(1) as usize) {
            source.read_at(self.at + index * self.len as u64, &mut record, "a sample")?;
            for (range, value) in ranges.iter_mut().zip(&self.values) {
                range.add(Some(self.column(&record, *value).value(0)));
            }
        }
        Ok(ranges)
    }
}

/// A column of values of one type.
pub(crate) fn column(raw: Raw<'_>, stored: Stored, big_endian: bool) -> Column {
    macro_rules! of {
        ($type:ty) => {
            if big_endian {
                raw.values(<$type>::from_be_bytes)
            } else {
                raw.values(<$type>::from_le_bytes)
            }
        };
    }
    match stored {
        Stored::U8 => Column::U8(of!(u8)),
        Stored::I8 => Column::I8(of!(i8)),
        Stored::U16 => Column::U16(of!(u16)),
        Stored::I16 => Column::I16(of!(i16)),
        Stored::U32 => Column::U32(of!(u32)),
        Stored::I32 => Column::I32(of!(i32)),
        Stored::F32 => Column::F32(of!(f32)),
        Stored::F64 => Column::F64(of!(f64)),
        Stored::U64 => Column::F64(of!(u64).into_iter().map(|value| value as f64).collect()),
        Stored::I64 => Column::F64(of!(i64).into_iter().map(|value| value as f64).collect()),
    }
}

/// Reads records from first to last.
pub(crate) struct RecordRows {
    source: Box<dyn Source>,
    records: Records,
    next: u64,
    /// Records that are there.
    fit: u64,
    buffer: Vec<u8>,
    doubled: Option<usize>,
}

impl RecordRows {
    /// `doubled`: a column that comes once more, last.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn new(
        mut source: Box<dyn Source>,
        records: Records,
        doubled: Option<usize>,
        damages: &mut Damages,
    ) -> Result<Self, Error> {
        let file_len = source.byte_len()?;
        let fit = records.fit(file_len);
        if fit < records.count {
            let at = records.at + fit * records.len as u64;
            damages.add(
                format!("record {fit} (byte {at})"),
                format!("the file ends at byte {file_len}"),
                records.count - fit,
            );
        }
        Ok(Self { source, records, next: 0, fit, buffer: Vec::new(), doubled })
    }
}

impl Rows for RecordRows {
    fn next(&mut self, _: &mut Damages, _: &mut Notes) -> Result<Option<Batch>, Error> {
        let len = self.records.len as u64;
        let count = (self.fit - self.next).min((BATCH_BYTES / len.max(1)).max(1));
        if count == 0 {
            return Ok(None);
        }
        self.buffer.resize((count * len) as usize, 0);
        let at = self.records.at + self.next * len;
        self.source.read_at(at, &mut self.buffer, &format!("record {}", self.next))?;
        let values = self.records.values.iter();
        let mut columns: Vec<Column> =
            values.map(|value| self.records.column(&self.buffer, *value)).collect();
        columns.extend(self.doubled.map(|index| columns[index].clone()));
        let numbers = Numbers::From(self.next);
        self.next += count;
        Ok(Some(Batch { columns, noun: "record".to_owned(), numbers, source_id: 0 }))
    }
}

/// Says when 32-bit coordinates are too large to tell a millimetre.
pub(crate) fn note_steps(largest: f64, notes: &mut Notes) {
    let largest = largest.abs() as f32;
    let step_m = largest.next_up() - largest;
    if largest.is_finite() && f64::from(step_m) > 1e-3 {
        notes.say(format!(
            "coordinates are 32-bit floating-point numbers of up to {largest:.0}: they are multiples \
             of {step_m}, and nothing finer can be got back; save the file with 64 bits or shifted \
             to near 0"
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_of_every_type_and_order() {
        let check = |stored: Stored, big: bool, bytes: &[u8], expected: f64| {
            let raw = Raw { records: bytes, record_len: bytes.len(), at: 0 };
            assert_eq!(column(raw, stored, big).value(0), expected, "{stored:?}");
        };
        check(Stored::U8, false, &[200], 200.0);
        check(Stored::I8, true, &[200], -56.0);
        check(Stored::U16, true, &[1, 2], 258.0);
        check(Stored::I16, false, &[0xFE, 0xFF], -2.0);
        check(Stored::U32, true, &70_000u32.to_be_bytes(), 70_000.0);
        check(Stored::I32, false, &(-70_000i32).to_le_bytes(), -70_000.0);
        check(Stored::F32, true, &0.5f32.to_be_bytes(), 0.5);
        check(Stored::F64, false, &0.1f64.to_le_bytes(), 0.1);
        check(Stored::U64, false, &(1u64 << 40).to_le_bytes(), 1.099511627776e12);
        check(Stored::I64, true, &(-5i64).to_be_bytes(), -5.0);
    }

    #[test]
    fn coarse_steps_are_said() {
        let said = |largest: f64| {
            let mut notes = Notes::default();
            note_steps(largest, &mut notes);
            notes.into_messages()
        };
        assert!(said(5000.0).is_empty() && said(f64::NAN).is_empty());
        assert!(said(-5_412_345.0)[0].contains("multiples of 0.5"));
    }
}
