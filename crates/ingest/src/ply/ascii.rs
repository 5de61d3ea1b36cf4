//! ASCII PLY: one record a line.

use super::Layout;
use super::header::{Header, Property};
use crate::Error;
use crate::attributes::Role;
use crate::source::Source;
use crate::table::{Field, RowFormat, Separator};
use crate::text::Range;

/// Bytes from which ranges are sampled, from where the points begin if what is before is short.
const SAMPLE: u64 = 1 << 16;

/// How the records of an element are written.
pub(super) fn row_format(header: &Header, index: usize, layout: &Layout) -> RowFormat {
    let mut column = 0;
    let fields = header.elements[index].properties.iter().map(|property| match property {
        Property::List { .. } => Field::List,
        Property::Scalar { .. } if column == layout.len() => Field::Skip,
        Property::Scalar { .. } => {
            let needed = matches!(layout[column].0, Role::Axis(_));
            column += 1;
            Field::Value { column: column - 1, needed }
        }
    });
    RowFormat {
        separator: Separator::Blanks,
        decimal_comma: false,
        newline: header.newline,
        fields: fields.collect(),
        columns: layout.len(),
        free: false,
    }
}

/// Lines of the elements before.
pub(super) fn lines_before(header: &Header, index: usize) -> u64 {
    header.elements[..index].iter().fold(0, |sum, element| element.count.saturating_add(sum))
}

/// Ranges of the values of the first records.
///
/// # Errors
/// [`Error::Io`].
pub(super) fn sample(
    source: &mut dyn Source,
    header: &Header,
    index: usize,
    layout: &Layout,
) -> Result<Vec<Range>, Error> {
    let len = source.byte_len()?.saturating_sub(header.data_at).min(SAMPLE);
    let mut bytes = vec![0; len as usize];
    source.read_at(header.data_at, &mut bytes, "a sample")?;
    let mut lines = bytes.split_inclusive(|byte| *byte == header.newline);
    let before = lines_before(header, index).min(SAMPLE) as usize;
    let body: Vec<u8> = lines.by_ref().skip(before).flatten().copied().collect();
    let mut rows = row_format(header, index, layout).rows(&body);
    rows.truncate(header.elements[index].count);
    Ok(rows.columns.iter().map(|column| Range::of(column)).collect())
}
