//! Points as text: XYZ, TXT, ASC, PTS, CSV.
//!
//! The file's beginning tells the separator, the decimal mark, and what the columns are; samples
//! from all over it tell the ranges of intensities and colours.

mod columns;
mod dialect;
mod rows;

pub(crate) use columns::Range;
pub(crate) use rows::note_faults;

use crate::assemble::{Assembler, Scaling};
use crate::attributes::Role;
use crate::blocks::Blocks;
use crate::damages::Damages;
use crate::scan::ColumnScan;
use crate::source::Source;
use crate::table::{Field, RowFormat, Values, number};
use crate::{Error, Notes};
use columns::{colour, intensity};
use dialect::Dialect;
use rows::TextRows;
use timberline_artefact::Crs;

/// Bytes that decide how the file is written.
const SAMPLE_BYTES: u64 = 1 << 16;
/// Places from which values are sampled, and bytes read at each.
const PLACES: u64 = 32;
const PLACE_BYTES: u64 = 1 << 12;
/// Column with the intensities as they stand in the file, where they had to be scaled.
pub(crate) const AS_GIVEN: &str = "intensity_as_given";

/// Opens a text file of points.
///
/// # Errors
/// [`Error::Foreign`] and [`Error::Content`] for texts that are no point cloud, [`Error::Io`].
pub(crate) fn open(mut source: Box<dyn Source>, crs: Crs) -> Result<ColumnScan, Error> {
    let len = source.byte_len()?;
    let mut sample = vec![0; len.min(SAMPLE_BYTES) as usize];
    source.read_at(0, &mut sample, "the beginning")?;
    let bom = if sample.starts_with(b"\xEF\xBB\xBF") { 3 } else { 0 };
    let mut dialect = Dialect::of(&sample[bom..], len <= SAMPLE_BYTES)?;
    dialect.data_at += bom as u64;
    let ranges = sample_ranges(source.as_mut(), &dialect, len)?;
    let mut said = std::mem::take(&mut dialect.notes);
    let roles = columns::roles(&dialect, &ranges, &mut said);
    let mut notes = Notes::default();
    said.into_iter().for_each(|note| notes.say(note));
    let (format, kept, ranges) = row_format(&dialect, roles, &ranges);
    let mut assembler = Assembler::new(kept, &crs);
    let doubled = scale(&mut assembler, &ranges, &mut notes);
    let blocks = Blocks::new(source, dialect.data_at, dialect.newline)?;
    let rows = Box::new(TextRows::new(blocks, format, &dialect, doubled));
    let damages = Damages::default();
    Ok(ColumnScan { container: "text", crs, notes, assembler, damages, rows })
}

/// Ranges of the values of all columns, from lines all over the file.
fn sample_ranges(
    source: &mut dyn Source,
    dialect: &Dialect,
    len: u64,
) -> Result<Vec<Range>, Error> {
    let mut ranges = vec![Range::NOTHING; dialect.width];
    let span = len.saturating_sub(dialect.data_at);
    for place in 0..PLACES {
        let at = dialect.data_at + span / PLACES * place;
        let mut bytes = vec![0; PLACE_BYTES.min(len - at) as usize];
        source.read_at(at, &mut bytes, "a sample")?;
        let cut = usize::from(place > 0);
        let lines: Vec<&[u8]> = bytes.split(|byte| *byte == dialect.newline).collect();
        let end = lines.len().saturating_sub(usize::from(at + (bytes.len() as u64) < len));
        for line in lines.get(cut..end).unwrap_or_default() {
            let values = Values { rest: line.trim_ascii(), separator: dialect.separator };
            let values: Vec<&[u8]> = values.collect();
            if values.len() < 3 {
                continue;
            }
            for (range, value) in ranges.iter_mut().zip(values) {
                if !value.is_empty() {
                    range.add(number(value, dialect.decimal_comma));
                }
            }
        }
    }
    Ok(ranges)
}

/// How rows are read, and the roles and ranges of the columns that are kept.
fn row_format(
    dialect: &Dialect,
    roles: Vec<Option<Role>>,
    ranges: &[Range],
) -> (RowFormat, Vec<Role>, Vec<Range>) {
    let (mut fields, mut kept, mut kept_ranges) = (Vec::new(), Vec::new(), Vec::new());
    for (role, range) in roles.into_iter().zip(ranges) {
        fields.push(match role {
            None => Field::Skip,
            Some(role) => {
                let needed = matches!(role, Role::Axis(_));
                kept.push(role);
                kept_ranges.push(*range);
                Field::Value { column: kept.len() - 1, needed }
            }
        });
    }
    let format = RowFormat {
        separator: dialect.separator,
        decimal_comma: dialect.decimal_comma,
        newline: dialect.newline,
        fields,
        columns: kept.len(),
        free: true,
    };
    (format, kept, kept_ranges)
}

/// Sets how intensities and colours become 16 bits. Intensities that do not fit are also kept as
/// they are, in a further column: the returned one must be given once more, last.
pub(crate) fn scale(
    assembler: &mut Assembler,
    ranges: &[Range],
    notes: &mut Notes,
) -> Option<usize> {
    let pairs = || assembler.roles.iter().zip(ranges);
    let is_colour = |role: &Role| matches!(role, Role::Colour(_));
    let colours: Vec<&Range> = pairs().filter(|(role, _)| is_colour(role)).map(|p| p.1).collect();
    let colour = if colours.is_empty() { Scaling::NONE } else { colour(&colours) };
    let column = assembler.roles.iter().position(|role| *role == Role::Intensity);
    assembler.colour = colour;
    let (scaling, said) = intensity(ranges.get(column?)?)?;
    assembler.intensity = scaling;
    assembler.roles.push(Role::Extra(AS_GIVEN.to_owned()));
    notes.say(said);
    column
}

#[cfg(test)]
mod tests;
