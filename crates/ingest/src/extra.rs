//! Extra bytes: attributes beyond the point format, described by records or not at all.
//!
//! ASPRS LAS 1.4-R15, tables 24 and 25: 192 bytes for each attribute: reserved 2, data type 1,
//! options 1, name 32, unused 4, nodata 3 x 8, min 3 x 8, max 3 x 8, scale 3 x 8, offset 3 x 8,
//! description 32.

use crate::Notes;
use crate::vlr::RecordData;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use timberline_pointcloud::Column;

const DESCRIPTION_LEN: usize = 192;
/// More attributes than any file has: a damaged header may promise 65,000 bytes a point.
const MAX_FIELDS: usize = 256;
/// Columns of other origin; an attribute of the same name gets a number.
const TAKEN: [&str; 6] = ["red", "green", "blue", "nir", "user_data", "scanner_channel"];

/// Type of the values as stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the variants are the types")]
pub enum Stored {
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Stored {
    fn of(code: u8) -> Option<Self> {
        let all = [
            Self::U8,
            Self::I8,
            Self::U16,
            Self::I16,
            Self::U32,
            Self::I32,
            Self::U64,
            Self::I64,
            Self::F32,
            Self::F64,
        ];
        all.get(usize::from(code).checked_sub(1)?).copied()
    }

    pub(crate) fn len(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

/// One attribute: where it stands and how its values are meant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExtraField {
    /// Name of its column.
    pub name: String,
    /// What the file says it is.
    pub description: String,
    /// Byte of the record at which it begins.
    pub at: usize,
    /// Type as stored.
    pub stored: Stored,
    /// Value = stored x scale + offset; such attributes become `f64`.
    pub scaled: Option<(f64, f64)>,
    /// Stored value that means there is none; it becomes NaN in scaled and floating attributes.
    pub nodata: Option<f64>,
}

/// The attributes of a file whose extra bytes begin at `from` and end at `to` of the record.
///
/// Descriptions that do not fit are left out with a note; bytes nobody describes become columns
/// `extra_bytes_1`, `extra_bytes_2` and so on of `u8`.
#[must_use]
pub fn fields(
    records: &[RecordData],
    from: usize,
    to: usize,
    notes: &mut Notes,
) -> Vec<ExtraField> {
    let names: BTreeSet<String> = TAKEN.iter().map(|name| (*name).to_owned()).collect();
    let mut layout = Fields { at: from, to, fields: Vec::new(), names, left_out: 0 };
    'records: for record in records {
        if !record.bytes.len().is_multiple_of(DESCRIPTION_LEN) {
            notes.say(format!(
                "extra bytes record (byte {}): {} bytes are no multiple of {DESCRIPTION_LEN}",
                record.at,
                record.bytes.len()
            ));
        }
        for (index, bytes) in record.bytes.chunks_exact(DESCRIPTION_LEN).enumerate() {
            if let Err(problem) = layout.add(&Described::parse(bytes)) {
                let at = record.at + (index * DESCRIPTION_LEN) as u64;
                notes.say(format!(
                    "extra bytes description at byte {at}: {problem}; it and all after it are left \
                     out, their bytes are kept by number"
                ));
                break 'records;
            }
        }
    }
    layout.undocumented();
    if layout.left_out > 0 {
        notes.say(format!(
            "{} extra bytes a point beyond the first {MAX_FIELDS} attributes are left out",
            layout.left_out
        ));
    }
    layout.fields
}

/// A description as it stands in the file.
struct Described {
    code: u8,
    options: u8,
    name: String,
    nodata: [u8; 24],
    scale: [f64; 3],
    offset: [f64; 3],
    description: String,
}

impl Described {
    fn parse(bytes: &[u8]) -> Self {
        let text = |range: std::ops::Range<usize>| {
            let bytes = bytes[range].split(|byte| *byte == 0).next().unwrap_or_default();
            String::from_utf8_lossy(bytes).trim().to_owned()
        };
        let numbers =
            |at: usize| std::array::from_fn(|i| f64::from_le_bytes(eight(&bytes[at + 8 * i..])));
        let mut nodata = [0; 24];
        nodata.copy_from_slice(&bytes[40..64]);
        Self {
            code: bytes[2],
            options: bytes[3],
            name: text(4..36),
            nodata,
            scale: numbers(112),
            offset: numbers(136),
            description: text(160..192),
        }
    }
}

fn eight(bytes: &[u8]) -> [u8; 8] {
    let mut out = [0; 8];
    out.copy_from_slice(&bytes[..8]);
    out
}

const HAS_NODATA: u8 = 1;
const HAS_SCALE: u8 = 8;
const HAS_OFFSET: u8 = 16;

struct Fields {
    at: usize,
    to: usize,
    fields: Vec<ExtraField>,
    names: BTreeSet<String>,
    left_out: usize,
}

impl Fields {
    fn add(&mut self, described: &Described) -> Result<(), String> {
        let name = &described.name;
        if described.code == 0 {
            // Undocumented: the options byte holds the number of bytes.
            let count = usize::from(described.options);
            self.check_room(name, count)?;
            let base = if name.is_empty() { "extra_bytes" } else { name };
            (0..count).for_each(|_| self.push(base, Stored::U8, described, 0, count > 1));
            return Ok(());
        }
        // Types 11 to 30 are pairs and triples of types 1 to 10 (deprecated since LAS 1.4-R14).
        let (code, parts) =
            ((described.code - 1) % 10 + 1, usize::from((described.code - 1) / 10 + 1));
        let stored = Stored::of(code).filter(|_| parts <= 3);
        let stored = stored.ok_or_else(|| format!("data type {} is not known", described.code))?;
        self.check_room(name, stored.len() * parts)?;
        let base = if name.is_empty() { "extra_bytes" } else { name };
        (0..parts).for_each(|part| self.push(base, stored, described, part, parts > 1));
        Ok(())
    }

    fn check_room(&self, name: &str, len: usize) -> Result<(), String> {
        let room = self.to - self.at;
        if len <= room {
            return Ok(());
        }
        Err(format!("`{name}` needs {len} bytes, the point records have {room} left"))
    }

    fn push(&mut self, base: &str, stored: Stored, from: &Described, part: usize, numbered: bool) {
        if self.fields.len() == MAX_FIELDS {
            self.left_out += stored.len();
            self.at += stored.len();
            return;
        }
        let name = self.free_name(base, numbered || base == "extra_bytes");
        let described = from.code != 0;
        let (has_scale, has_offset) =
            (from.options & HAS_SCALE != 0, from.options & HAS_OFFSET != 0);
        let scale = if has_scale && from.scale[part].is_finite() { from.scale[part] } else { 1.0 };
        let offset =
            if has_offset && from.offset[part].is_finite() { from.offset[part] } else { 0.0 };
        let is_scaled = described && (scale, offset) != (1.0, 0.0) && scale != 0.0;
        let has_nodata = described && from.options & HAS_NODATA != 0;
        self.fields.push(ExtraField {
            name,
            description: from.description.clone(),
            at: self.at,
            stored,
            scaled: is_scaled.then_some((scale, offset)),
            nodata: has_nodata.then(|| nodata(eight(&from.nodata[8 * part..]), stored)),
        });
        self.at += stored.len();
    }

    /// A name not used yet: the base, or the base with the first free number.
    fn free_name(&mut self, base: &str, numbered: bool) -> String {
        let plain = (!numbered).then(|| base.to_owned());
        let first = if numbered { 1 } else { 2 };
        let numbers = (first..).map(|number| format!("{base}_{number}"));
        let free = plain.into_iter().chain(numbers).find(|name| !self.names.contains(name));
        let name = free.unwrap_or_else(|| base.to_owned());
        self.names.insert(name.clone());
        name
    }

    fn undocumented(&mut self) {
        let nothing = Described::parse(&[0; DESCRIPTION_LEN]);
        (self.at..self.to).for_each(|_| self.push("extra_bytes", Stored::U8, &nothing, 0, true));
    }
}

/// "No data" is stored as the widest type of the attribute's family.
fn nodata(bytes: [u8; 8], stored: Stored) -> f64 {
    match stored {
        Stored::U8 | Stored::U16 | Stored::U32 | Stored::U64 => u64::from_le_bytes(bytes) as f64,
        Stored::I8 | Stored::I16 | Stored::I32 | Stored::I64 => i64::from_le_bytes(bytes) as f64,
        Stored::F32 | Stored::F64 => f64::from_le_bytes(bytes),
    }
}

impl ExtraField {
    /// The attribute's values from records of `record_len` bytes.
    #[must_use]
    pub fn column(&self, records: &[u8], record_len: usize) -> Column {
        let raw = Raw { records, record_len, at: self.at };
        if self.scaled.is_some() || matches!(self.stored, Stored::U64 | Stored::I64) {
            return Column::F64(self.scaled_values(&raw));
        }
        let missing = |value: f64| self.nodata == Some(value);
        match self.stored {
            Stored::U8 => Column::U8(raw.values(u8::from_le_bytes)),
            Stored::I8 => Column::I8(raw.values(i8::from_le_bytes)),
            Stored::U16 => Column::U16(raw.values(u16::from_le_bytes)),
            Stored::I16 => Column::I16(raw.values(i16::from_le_bytes)),
            Stored::U32 => Column::U32(raw.values(u32::from_le_bytes)),
            Stored::I32 => Column::I32(raw.values(i32::from_le_bytes)),
            Stored::F32 => Column::F32(raw.values(|bytes| {
                let value = f32::from_le_bytes(bytes);
                if missing(f64::from(value)) { f32::NAN } else { value }
            })),
            Stored::F64 | Stored::U64 | Stored::I64 => Column::F64(raw.values(|bytes| {
                let value = f64::from_le_bytes(bytes);
                if missing(value) { f64::NAN } else { value }
            })),
        }
    }

    fn scaled_values(&self, raw: &Raw<'_>) -> Vec<f64> {
        let stored: Vec<f64> = match self.stored {
            Stored::U8 => raw.values(|b| f64::from(u8::from_le_bytes(b))),
            Stored::I8 => raw.values(|b| f64::from(i8::from_le_bytes(b))),
            Stored::U16 => raw.values(|b| f64::from(u16::from_le_bytes(b))),
            Stored::I16 => raw.values(|b| f64::from(i16::from_le_bytes(b))),
            Stored::U32 => raw.values(|b| f64::from(u32::from_le_bytes(b))),
            Stored::I32 => raw.values(|b| f64::from(i32::from_le_bytes(b))),
            // Exact below 2^53; larger ids lose their last digits.
            Stored::U64 => raw.values(|b| u64::from_le_bytes(b) as f64),
            Stored::I64 => raw.values(|b| i64::from_le_bytes(b) as f64),
            Stored::F32 => raw.values(|b| f64::from(f32::from_le_bytes(b))),
            Stored::F64 => raw.values(f64::from_le_bytes),
        };
        let (scale, offset) = self.scaled.unwrap_or((1.0, 0.0));
        let meant = |value: f64| {
            if self.nodata == Some(value) { f64::NAN } else { value * scale + offset }
        };
        stored.into_iter().map(meant).collect()
    }
}

/// One field of all records.
pub(crate) struct Raw<'a> {
    pub(crate) records: &'a [u8],
    pub(crate) record_len: usize,
    pub(crate) at: usize,
}

impl Raw<'_> {
    pub(crate) fn values<const N: usize, T>(&self, from: impl Fn([u8; N]) -> T) -> Vec<T> {
        let at = self.at;
        let read = |record: &[u8]| {
            let mut bytes = [0; N];
            bytes.copy_from_slice(&record[at..at + N]);
            from(bytes)
        };
        self.records.chunks_exact(self.record_len).map(read).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn description(code: u8, options: u8, name: &str) -> Vec<u8> {
        let mut bytes = vec![0; DESCRIPTION_LEN];
        bytes[2] = code;
        bytes[3] = options;
        bytes[4..4 + name.len()].copy_from_slice(name.as_bytes());
        bytes
    }

    fn check(bytes: Vec<u8>, room: usize) -> (Vec<ExtraField>, Vec<String>) {
        let mut notes = Notes::default();
        let fields = fields(&[RecordData { at: 281, bytes }], 20, 20 + room, &mut notes);
        (fields, notes.into_messages())
    }

    fn names(fields: &[ExtraField]) -> Vec<&str> {
        fields.iter().map(|field| field.name.as_str()).collect()
    }

    #[test]
    fn described_and_undocumented_bytes() {
        let bytes = [description(3, 0, "width"), description(0, 2, ""), description(9, 0, "red")];
        let (found, notes) = check(bytes.concat(), 9);
        assert_eq!(
            names(&found),
            ["width", "extra_bytes_1", "extra_bytes_2", "red_2", "extra_bytes_3"]
        );
        assert_eq!(found[3].at, 24);
        assert!(notes.is_empty());
    }

    /// A description of an attribute for which the records have no bytes at all.
    #[test]
    fn a_description_without_bytes_is_left_out() {
        let (found, notes) = check(description(3, 0, "TestEB"), 0);
        assert!(found.is_empty());
        assert!(notes[0].contains("`TestEB` needs 2 bytes, the point records have 0 left"));
    }

    #[test]
    fn garbage_types_and_lengths_end_the_list() {
        let bytes = [description(99, 0, "x"), description(3, 0, "never")].concat();
        let (found, notes) = check(bytes[..300].to_vec(), 2);
        assert_eq!(names(&found), ["extra_bytes_1", "extra_bytes_2"]);
        assert!(notes[0].contains("no multiple of 192") && notes[1].contains("data type 99"));
    }

    /// Found by fuzzing: naming twelve thousand columns took minutes.
    #[test]
    fn records_of_thousands_of_bytes_are_cut() {
        let (found, notes) = check(Vec::new(), 60_000);
        assert_eq!(found.len(), MAX_FIELDS);
        assert!(notes[0].contains("59744 extra bytes"), "{notes:?}");
    }

    #[test]
    fn scales_offsets_and_nodata() {
        let mut bytes = description(4, HAS_SCALE | HAS_OFFSET | HAS_NODATA, "tilt");
        bytes[40..48].copy_from_slice(&(-99i64).to_le_bytes());
        bytes[112..120].copy_from_slice(&0.5f64.to_le_bytes());
        bytes[136..144].copy_from_slice(&10.0f64.to_le_bytes());
        let (found, _) = check(bytes, 2);
        let mut records = vec![0; 44];
        records[20..22].copy_from_slice(&(-4i16).to_le_bytes());
        records[42..44].copy_from_slice(&(-99i16).to_le_bytes());
        let Column::F64(values) = found[0].column(&records, 22) else { panic!("not f64") };
        assert_eq!(values[0], 8.0);
        assert!(values[1].is_nan());
    }

    #[test]
    fn triples_become_three_columns() {
        let (found, _) = check(description(23, 0, "normal"), 6);
        assert_eq!(names(&found), ["normal_1", "normal_2", "normal_3"]);
        assert_eq!(found[2].stored, Stored::U16);
    }
}
