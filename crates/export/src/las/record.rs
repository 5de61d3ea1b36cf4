//! Point records, byte by byte (LAS 1.4 R15, tables 7 to 18).

use super::{Colour, Dimension, DimensionType, LasOptions, LasVersion};
use crate::Error;
use std::path::Path;
use timberline_artefact::Crs;
use timberline_pointcloud::{Column, PointCloud};

/// Names of the extra columns that hold colours.
pub(super) const COLOURS: [&str; 4] = ["red", "green", "blue", "nir"];
/// Names of the extra columns that have a place of their own in a record.
pub(super) const USER_DATA: &str = "user_data";
pub(super) const SCANNER_CHANNEL: &str = "scanner_channel";

/// How the records of a file look.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) colour: Colour,
    version: LasVersion,
    scale: f64,
    offset: [f64; 3],
    dimensions: Vec<Dimension>,
}

/// The extra columns of a cloud that a file takes; missing ones `None`.
pub(super) struct Columns<'a> {
    user_data: Option<&'a Column>,
    scanner_channel: Option<&'a Column>,
    colours: Vec<Option<&'a Column>>,
    dimensions: Vec<Option<&'a Column>>,
}

impl Layout {
    pub(super) fn new(options: &LasOptions) -> Self {
        let legacy = options.version == LasVersion::V1_2;
        Self {
            colour: if legacy { options.colour.min(Colour::Rgb) } else { options.colour },
            version: options.version,
            scale: options.scale,
            offset: options.offset,
            dimensions: options.dimensions.clone(),
        }
    }

    /// Bytes of extra dimensions in a record.
    pub(super) fn extra_len(&self) -> usize {
        self.dimensions.iter().map(|dimension| dimension.kind.size()).sum()
    }

    /// Bytes of a record.
    pub(super) fn record_len(&self) -> usize {
        let core = if self.version == LasVersion::V1_4 { 30 } else { 28 };
        core + 2 * self.colours() + self.extra_len()
    }

    fn colours(&self) -> usize {
        match self.colour {
            Colour::None => 0,
            Colour::Rgb => 3,
            Colour::RgbNir => 4,
        }
    }

    /// Finds the columns in a cloud.
    pub(super) fn columns<'a>(
        &self,
        cloud: &'a PointCloud,
        path: &Path,
    ) -> Result<Columns<'a>, Error> {
        let find = |name: &str, kind: DimensionType| match cloud.extra.get(name) {
            Some(column) if DimensionType::of(column) != kind => Err(Error::DimensionType {
                path: path.to_path_buf(),
                name: name.to_owned(),
                expected: kind.name(),
                found: column.type_name(),
            }),
            column => Ok(column),
        };
        let colours = COLOURS[..self.colours()].iter().map(|name| find(name, DimensionType::U16));
        let dimensions = self.dimensions.iter().map(|d| find(&d.name, d.kind));
        Ok(Columns {
            user_data: find(USER_DATA, DimensionType::U8)?,
            scanner_channel: find(SCANNER_CHANNEL, DimensionType::U8)?,
            colours: colours.collect::<Result<_, _>>()?,
            dimensions: dimensions.collect::<Result<_, _>>()?,
        })
    }

    /// Appends the record of a point.
    pub(super) fn push(
        &self,
        bytes: &mut Vec<u8>,
        cloud: &PointCloud,
        index: usize,
        columns: &Columns<'_>,
        crs: &Crs,
        path: &Path,
    ) -> Result<(), Error> {
        let position = crs.crs_from_world(cloud.world(index));
        for (axis, value) in position.into_iter().enumerate() {
            bytes.extend(self.coordinate(value, axis, path)?.to_le_bytes());
        }
        bytes.extend(cloud.intensity[index].to_le_bytes());
        match self.version {
            LasVersion::V1_4 => push_modern(bytes, cloud, index, columns, path)?,
            LasVersion::V1_2 => push_legacy(bytes, cloud, index, columns, path)?,
        }
        let time = cloud.gps_time[index];
        bytes.extend(if time.is_nan() { 0.0 } else { time }.to_le_bytes());
        for colour in &columns.colours {
            let value = if let Some(Column::U16(values)) = colour { values[index] } else { 0 };
            bytes.extend(value.to_le_bytes());
        }
        for (dimension, column) in self.dimensions.iter().zip(&columns.dimensions) {
            match column {
                Some(column) => push_value(bytes, column, index),
                None => bytes.resize(bytes.len() + dimension.kind.size(), 0),
            }
        }
        Ok(())
    }

    fn coordinate(&self, value: f64, axis: usize, path: &Path) -> Result<i32, Error> {
        let steps = ((value - self.offset[axis]) / self.scale).round();
        if steps >= f64::from(i32::MIN) && steps <= f64::from(i32::MAX) {
            return Ok(steps as i32);
        }
        Err(Error::CoordinateRange {
            path: path.to_path_buf(),
            axis: ['x', 'y', 'z'][axis],
            value,
            offset: self.offset[axis],
            scale: self.scale,
        })
    }
}

fn push_value(bytes: &mut Vec<u8>, column: &Column, index: usize) {
    match column {
        Column::U8(values) => bytes.push(values[index]),
        Column::I8(values) => bytes.extend(values[index].to_le_bytes()),
        Column::U16(values) => bytes.extend(values[index].to_le_bytes()),
        Column::I16(values) => bytes.extend(values[index].to_le_bytes()),
        Column::U32(values) => bytes.extend(values[index].to_le_bytes()),
        Column::I32(values) => bytes.extend(values[index].to_le_bytes()),
        Column::F32(values) => bytes.extend(values[index].to_le_bytes()),
        Column::F64(values) => bytes.extend(values[index].to_le_bytes()),
    }
}

/// The value of a column of bytes; 0 without one.
fn byte(column: Option<&Column>, index: usize) -> u8 {
    if let Some(Column::U8(values)) = column { values[index] } else { 0 }
}

/// Refuses a value that its field has no room for.
fn within(
    value: u8,
    limit: u8,
    field: &'static str,
    path: &Path,
    (minor, format): (u8, u8),
) -> Result<u8, Error> {
    let path = || path.to_path_buf();
    if value <= limit {
        return Ok(value);
    }
    Err(Error::FieldRange { path: path(), field, value, limit, minor, format })
}

/// Returns to source id of point formats 6 and above.
fn push_modern(
    bytes: &mut Vec<u8>,
    cloud: &PointCloud,
    index: usize,
    columns: &Columns<'_>,
    path: &Path,
) -> Result<(), Error> {
    let returns = |value, field| within(value, 15, field, path, (4, 6));
    let number = returns(cloud.return_number[index], "return number")?;
    let count = returns(cloud.number_of_returns[index], "number of returns")?;
    let flags = cloud.flags[index];
    let (edge, direction) = (flags >> 4 & 1, flags >> 5 & 1);
    bytes.push(number | count << 4);
    let channel = byte(columns.scanner_channel, index) & 0x03;
    // Bits 0 to 3 are the same in the store; 4 and 5 are the scanner channel; 6 direction, 7 edge.
    bytes.push(flags & 0x0F | channel << 4 | direction << 6 | edge << 7);
    bytes.push(cloud.classification[index]);
    bytes.push(byte(columns.user_data, index));
    let angle = (cloud.scan_angle_deg[index] / 0.006).round() as i16;
    bytes.extend(angle.to_le_bytes());
    bytes.extend(cloud.source_id[index].to_le_bytes());
    Ok(())
}

/// Returns to source id of point formats 0 to 5. The overlap flag has no place there.
fn push_legacy(
    bytes: &mut Vec<u8>,
    cloud: &PointCloud,
    index: usize,
    columns: &Columns<'_>,
    path: &Path,
) -> Result<(), Error> {
    let small = |value, limit, field| within(value, limit, field, path, (2, 1));
    // The field holds 7, the counts in the header only returns 1 to 5.
    let number = small(cloud.return_number[index], 5, "return number")?;
    let count = small(cloud.number_of_returns[index], 7, "number of returns")?;
    let class = small(cloud.classification[index], 31, "classification")?;
    let flags = cloud.flags[index];
    let (edge, direction) = (flags >> 4 & 1, flags >> 5 & 1);
    bytes.push(number | count << 3 | direction << 6 | edge << 7);
    bytes.push(class | (flags & 0x07) << 5);
    bytes.push((cloud.scan_angle_deg[index].round() as i8).to_le_bytes()[0]);
    bytes.push(byte(columns.user_data, index));
    bytes.extend(cloud.source_id[index].to_le_bytes());
    Ok(())
}
