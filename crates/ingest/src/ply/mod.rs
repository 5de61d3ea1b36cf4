//! PLY: binary of either byte order, and ASCII.
//!
//! The points are the element `vertex`, or the first with x, y and z. Lists are stepped over, other
//! elements too; coordinates keep the type they have in the file.

mod ascii;
mod header;
mod lists;

use crate::assemble::Assembler;
use crate::attributes::{Role, missing_axes, roles_of};
use crate::blocks::Blocks;
use crate::counted::CountedRows;
use crate::damages::Damages;
use crate::extra::Stored;
use crate::records::{RecordRows, Records, Value, note_steps};
use crate::scan::{ColumnScan, Rows};
use crate::source::Source;
use crate::text::{Range, scale};
use crate::{Error, Notes};
use header::{Element, Encoding, Header, Property};
use timberline_artefact::Crs;

/// Opens a PLY file.
///
/// # Errors
/// [`Error::Content`] for a header that cannot be understood or has no points, [`Error::Io`].
pub(crate) fn open(mut source: Box<dyn Source>, crs: Crs) -> Result<ColumnScan, Error> {
    let header = Header::read(source.as_mut())?;
    let (index, layout) = find_points(&header)?;
    let (mut notes, mut damages) = (Notes::default(), Damages::default());
    let element = &header.elements[index];
    let mut assembler = Assembler::new(layout.iter().map(|(role, _)| role.clone()).collect(), &crs);
    if element.count == 0 {
        notes.say("the header counts no points");
    }
    let rows: Box<dyn Rows> = match (header.encoding, element.record_len()) {
        (Encoding::Ascii, _) => {
            let ranges = ascii::sample(source.as_mut(), &header, index, &layout)?;
            let doubled = prepare(&mut assembler, &layout, &ranges, &mut notes);
            let blocks = Blocks::new(source, header.data_at, header.newline)?;
            let format = ascii::row_format(&header, index, &layout);
            let before = ascii::lines_before(&header, index);
            let rows = CountedRows::new(blocks, format, header.lines, element.count);
            Box::new(rows.after(before).doubling(doubled))
        }
        (encoding, Some(len)) => {
            let at = lists::skip(source.as_mut(), &header, index)?;
            let big_endian = encoding == Encoding::Big;
            let values = layout.iter().map(|(_, value)| *value).collect();
            let records = Records { at, len, count: element.count, big_endian, values };
            let ranges = records.sample(source.as_mut())?;
            let doubled = prepare(&mut assembler, &layout, &ranges, &mut notes);
            Box::new(RecordRows::new(source, records, doubled, &mut damages)?)
        }
        (_, None) => {
            let at = lists::skip(source.as_mut(), &header, index)?;
            let ranges = lists::sample(source.as_mut(), &header, index, at, layout.len())?;
            let doubled = prepare(&mut assembler, &layout, &ranges, &mut notes);
            Box::new(lists::ListRows::new(source, &header, index, at, doubled)?)
        }
    };
    Ok(ColumnScan { container: "PLY", crs, notes, assembler, damages, rows })
}

/// The columns that are read: what each is, its type and its place in a record without lists.
type Layout = [(Role, Value)];

/// The element that holds the points, and its columns.
fn find_points(header: &Header) -> Result<(usize, Vec<(Role, Value)>), Error> {
    let vertex = header.elements.iter().position(|element| element.name == "vertex");
    let candidates = vertex.into_iter().chain(0..header.elements.len());
    let layouts = candidates.map(|index| (index, layout(&header.elements[index])));
    let mut missing = None;
    for (index, layout) in layouts {
        let roles: Vec<Option<Role>> = layout.iter().map(|(role, _)| Some(role.clone())).collect();
        let absent = missing_axes(&roles);
        if absent.is_empty() {
            return Ok((index, layout));
        }
        missing.get_or_insert((header.elements[index].name.clone(), absent));
    }
    let problem = missing.map_or_else(
        || "there is no element".to_owned(),
        |(name, axes)| format!("element `{name}` has no property {}", axes.join(", ")),
    );
    let remedy = "points are the element `vertex` with the properties x, y and z";
    Err(Error::Content { place: "PLY header".to_owned(), problem, remedy })
}

fn layout(element: &Element) -> Vec<(Role, Value)> {
    let mut at = 0;
    let mut scalars = Vec::new();
    for property in &element.properties {
        if let Property::Scalar { stored, name } = property {
            scalars.push((name.as_str(), Value { stored: *stored, at }));
            at += stored.len();
        }
    }
    let roles = roles_of(scalars.iter().map(|(name, _)| *name));
    let named = roles.into_iter().zip(scalars);
    named.filter_map(|(role, (_, value))| Some((role?, value))).collect()
}

/// Sets scalings by type and range, and says what should be known; the column to give once more.
fn prepare(
    assembler: &mut Assembler,
    layout: &Layout,
    ranges: &[Range],
    notes: &mut Notes,
) -> Option<usize> {
    let is_wide = |(role, value): &&(Role, Value)| {
        matches!(role, Role::Axis(_)) && value.stored == Stored::F32
    };
    let wide = layout.iter().zip(ranges).filter(|(column, _)| is_wide(column));
    let largest = wide.map(|(_, range)| range.min.abs().max(range.max.abs()));
    note_steps(largest.filter(|value| value.is_finite()).fold(0.0, f64::max), notes);
    scale(assembler, ranges, notes)
}

#[cfg(test)]
mod tests;
