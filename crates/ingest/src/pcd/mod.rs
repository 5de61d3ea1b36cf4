//! PCD, the format of the Point Cloud Library: ASCII, binary and compressed.

mod columns;
mod header;
mod lzf;

use crate::Error;
use crate::Notes;
use crate::assemble::{Assembler, Scaling};
use crate::attributes::{Role, missing_axes, roles_of};
use crate::blocks::Blocks;
use crate::counted::CountedRows;
use crate::damages::Damages;
use crate::extra::Stored;
use crate::records::{RecordRows, Records, Value, note_steps};
use crate::scan::{ColumnScan, Rows};
use crate::source::Source;
use crate::table::{Field as TextField, RowFormat, Separator};
use crate::text::{Range, scale};
use columns::{ColumnRows, Columns};
use header::{Encoding, Field, Header, NO_VIEWPOINT};
use timberline_artefact::Crs;
use timberline_pointcloud::Column;

/// Bytes of text from which ranges are sampled.
const SAMPLE: u64 = 1 << 16;
/// Fields that hold three colours of a byte each in four bytes: blue, green, red.
const PACKED: [&str; 2] = ["rgb", "rgba"];

/// A value that is read: what it is, of which field, and where in that field.
#[derive(Debug, Clone, PartialEq)]
struct Wanted {
    role: Role,
    field: usize,
    value: Value,
    /// First of the three colours in one packed field, which text has as one number.
    packed: bool,
}

/// Opens a PCD file.
///
/// # Errors
/// [`Error::Content`] for a header that cannot be understood or has no coordinates, [`Error::Io`].
pub(crate) fn open(mut source: Box<dyn Source>, crs: Crs) -> Result<ColumnScan, Error> {
    let header = Header::read(source.as_mut())?;
    let wanted = wanted(&header)?;
    let (mut notes, mut damages) = (Notes::default(), Damages::default());
    header.notes.iter().for_each(|note| notes.say(note));
    if header.points == 0 {
        notes.say("the header counts no points");
    }
    if header.viewpoint != NO_VIEWPOINT {
        let v = header.viewpoint;
        notes.say(format!(
            "the viewpoint ({} {} {}, rotation {} {} {} {}) is not applied to the points",
            v[0], v[1], v[2], v[3], v[4], v[5], v[6]
        ));
    }
    let mut assembler = Assembler::new(wanted.iter().map(|w| w.role.clone()).collect(), &crs);
    let rows = rows(source, &header, &wanted, &mut assembler, &mut notes, &mut damages)?;
    Ok(ColumnScan { container: "PCD", crs, notes, assembler, damages, rows })
}

fn rows(
    mut source: Box<dyn Source>,
    header: &Header,
    wanted: &[Wanted],
    assembler: &mut Assembler,
    notes: &mut Notes,
    damages: &mut Damages,
) -> Result<Box<dyn Rows>, Error> {
    Ok(match header.encoding {
        Encoding::Ascii => {
            let format = row_format(header, wanted);
            let ranges = sample_text(source.as_mut(), header, wanted, &format)?;
            let doubled = prepare(assembler, wanted, &ranges, notes);
            let blocks = Blocks::new(source, header.data_at, b'\n')?;
            let rows = CountedRows::new(blocks, format, header.lines, header.points);
            let wanted = wanted.to_vec();
            Box::new(
                rows.finishing(Box::new(move |columns| unpack(columns, &wanted))).doubling(doubled),
            )
        }
        Encoding::Binary => {
            let in_record =
                |w: &Wanted| Value { at: header.fields[w.field].at + w.value.at, ..w.value };
            let records = Records {
                at: header.data_at,
                len: header.record_len,
                count: header.points,
                big_endian: false,
                values: wanted.iter().map(in_record).collect(),
            };
            let ranges = records.sample(source.as_mut())?;
            let doubled = prepare(assembler, wanted, &ranges, notes);
            Box::new(RecordRows::new(source, records, doubled, damages)?)
        }
        Encoding::Compressed => {
            let columns = Columns::new(source.as_mut(), header, wanted, damages)?;
            let ranges = columns.clone().sample(source.as_mut())?;
            let doubled = prepare(assembler, wanted, &ranges, notes);
            Box::new(ColumnRows::new(source, columns, doubled))
        }
    })
}

/// The values that are read.
fn wanted(header: &Header) -> Result<Vec<Wanted>, Error> {
    let mut values: Vec<(String, usize, Value)> = Vec::new();
    for (index, field) in header.fields.iter().enumerate() {
        match field.name.as_str() {
            // Bytes that only align the next field.
            "_" => {}
            name if PACKED.contains(&name) && field.len() == 4 => {
                for (colour, at) in [("red", 2), ("green", 1), ("blue", 0)] {
                    values.push((colour.to_owned(), index, Value { stored: Stored::U8, at }));
                }
            }
            _ => values.extend(parts(field).map(|(name, value)| (name, index, value))),
        }
    }
    let roles = roles_of(values.iter().map(|(name, _, _)| name.as_str()));
    let missing = missing_axes(&roles);
    if !missing.is_empty() {
        return Err(Error::Content {
            place: "PCD header".to_owned(),
            problem: format!("FIELDS has no {}", missing.join(", ")),
            remedy: "points have the fields x, y and z",
        });
    }
    let all = roles.into_iter().zip(values);
    let all = all.filter_map(|(role, (_, field, value))| {
        let packed = PACKED.contains(&header.fields[field].name.as_str()) && value.at == 2;
        Some(Wanted { role: role?, field, value, packed })
    });
    Ok(all.collect())
}

/// More values of one field are some descriptor of the point's surroundings.
const MAX_PARTS: usize = 16;

/// The values of a field, with names.
fn parts(field: &Field) -> impl Iterator<Item = (String, Value)> {
    let numbered = field.count > 1;
    let count = if field.count > MAX_PARTS { 0 } else { field.count };
    (0..count).map(move |part| {
        let name =
            if numbered { format!("{}_{}", field.name, part + 1) } else { field.name.clone() };
        (name, Value { stored: field.stored, at: part * field.stored.len() })
    })
}

/// Sets scalings by type and range, and says what should be known; the column to give once more.
fn prepare(
    assembler: &mut Assembler,
    wanted: &[Wanted],
    ranges: &[Range],
    notes: &mut Notes,
) -> Option<usize> {
    let axes = wanted
        .iter()
        .zip(ranges)
        .filter(|(w, _)| matches!(w.role, Role::Axis(_)) && w.value.stored == Stored::F32);
    let largest = axes.map(|(_, range)| range.min.abs().max(range.max.abs()));
    note_steps(largest.filter(|value| value.is_finite()).fold(0.0, f64::max), notes);
    let doubled = scale(assembler, ranges, notes);
    let bytes = |w: &Wanted| matches!(w.role, Role::Colour(_)) && w.value.stored == Stored::U8;
    if wanted.iter().any(bytes) {
        assembler.colour = Scaling::BYTE;
    }
    doubled
}

/// How the lines of ASCII data are written: one column for each field that is read, the packed
/// colours once.
fn row_format(header: &Header, wanted: &[Wanted]) -> RowFormat {
    let mut fields = Vec::new();
    let mut columns = 0;
    for (index, field) in header.fields.iter().enumerate() {
        let of = wanted.iter().filter(|w| w.field == index);
        let is_read = of.clone().next().is_some();
        let needed = of.clone().any(|w| matches!(w.role, Role::Axis(_)));
        for _ in 0..field.count {
            fields.push(if is_read {
                TextField::Value { column: columns, needed }
            } else {
                TextField::Skip
            });
            columns += usize::from(is_read);
        }
    }
    let separator = Separator::Blanks;
    RowFormat { separator, decimal_comma: false, newline: b'\n', fields, columns, free: false }
}

/// Makes three columns of each packed colour read as one number.
fn unpack(columns: &mut Vec<Column>, wanted: &[Wanted]) {
    for index in wanted.iter().enumerate().filter(|(_, w)| w.packed).map(|(index, _)| index) {
        if index >= columns.len() {
            return;
        }
        let packed = columns.remove(index);
        for shift in [0u32, 8, 16] {
            let byte = |row: usize| f64::from(bits(packed.value(row)) >> shift & 255);
            columns.insert(index, Column::F64((0..packed.len()).map(byte).collect()));
        }
    }
}

/// The four bytes of a packed colour: written as the number they are, or as the floating-point
/// number that has the same bits (PCL up to 1.13), which is never a whole number above 0.
fn bits(value: f64) -> u32 {
    if value.fract() == 0.0 && (0.0..=4_294_967_295.0).contains(&value) {
        value as u32
    } else {
        (value as f32).to_bits()
    }
}

fn sample_text(
    source: &mut dyn Source,
    header: &Header,
    wanted: &[Wanted],
    format: &RowFormat,
) -> Result<Vec<Range>, Error> {
    let len = source.byte_len()?.saturating_sub(header.data_at).min(SAMPLE);
    let mut bytes = vec![0; len as usize];
    source.read_at(header.data_at, &mut bytes, "a sample")?;
    let mut rows = format.rows(&bytes);
    rows.truncate(header.points);
    let mut columns: Vec<Column> = rows.columns.into_iter().map(Column::F64).collect();
    unpack(&mut columns, wanted);
    let range = |column: &Column| {
        Range::of(&(0..column.len()).map(|row| column.value(row)).collect::<Vec<f64>>())
    };
    Ok(columns.iter().map(range).collect())
}

#[cfg(test)]
mod tests;
