//! The points of a tile, as MCAP with one `foxglove.PointCloud` for each occupied world-aligned
//! square of [`RUN_M`]. Raise the version when the fields, their meaning or the squares change.

use super::Kind;
use crate::mcap_file::{McapReader, McapWriter};
use crate::{Error, Header, Opened};
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud as PointCloudMessage, Pose};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::order::morton;
use timberline_pointcloud::{Column, Frame, PointCloud, Rect, TileGrid, TileId};

/// Edge of the squares whose points share a message: a power of two, hence one run of the canonical order.
pub const RUN_M: f64 = 32.0;
/// Name of the metadata record with the runs.
const RUNS_RECORD: &str = "timberline.runs";
const TOPIC: &str = "/points";

/// Points of one tile in canonical order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PointTile {
    /// The points; the frame's origin is the tile's south-west corner at a whole metre of elevation.
    pub cloud: PointCloud,
}

/// The points of one square: a run of the tile's order and one message.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Run {
    /// South-west corner in the world, metres.
    corner_m: [f64; 2],
    start: u32,
    len: u32,
}

/// Points of a tile within a rectangle.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Part {
    /// The points, in the tile's order and frame.
    pub cloud: PointCloud,
    /// Index of each in the tile.
    pub index: Vec<u32>,
    /// Number of points of the whole tile.
    pub tile_len: usize,
}

impl PointTile {
    /// The frame for points of a tile: its corner, at a whole metre below the lowest point.
    #[must_use]
    pub fn frame(grid: &TileGrid, tile: TileId, lowest_world_z_m: f64) -> Frame {
        let [x, y] = grid.corner_m(tile);
        let z = if lowest_world_z_m.is_finite() { lowest_world_z_m.floor() as i64 } else { 0 };
        Frame::new([x, y, z])
    }

    /// Reads only the squares that touch a closed world rectangle, and of them the points inside it.
    ///
    /// # Errors
    /// As [`crate::read`].
    pub fn read_within(path: &Path, rect: &Rect) -> Result<Part, Error> {
        let opened = Opened::open(path)?;
        crate::open::check_kind::<Self>(path, opened.header())?;
        let reader = opened.mcap(path)?;
        let wanted = |run: &Run| {
            let [x, y] = run.corner_m;
            Rect { min: [x, y], max: [x + RUN_M, y + RUN_M] }.touches(rect)
        };
        let mut part = read_runs(path, reader, wanted)?;
        keep_inside(&mut part, rect);
        Ok(part)
    }
}

impl Kind for PointTile {
    const NAME: &'static str = "points";
    const VERSION: u32 = 1;
    const EXTENSION: &'static str = "mcap";
    const SUMMARY: &'static str = "the points of a tile, to be opened in any MCAP viewer";

    fn encode(&self, header: &Header, out: &mut File) -> Result<(), Error> {
        encode_cloud(Self::NAME, &self.cloud, header, &[], out)
    }

    fn decode(path: &Path, opened: &mut Opened) -> Result<Self, Error> {
        let reader = opened.mcap(path)?;
        read_runs(path, reader, |_| true).map(|part| Self { cloud: part.cloud })
    }
}

/// Writes points in canonical order as an MCAP file, with further metadata records.
pub(super) fn encode_cloud(
    kind: &'static str,
    cloud: &PointCloud,
    header: &Header,
    records: &[(&str, String)],
    out: &mut File,
) -> Result<(), Error> {
    cloud.validate()?;
    let layout = Layout::of(cloud);
    let runs = runs(cloud);
    let mut writer = McapWriter::new(BufWriter::new(out))?;
    let channel = writer.channel::<PointCloudMessage>(TOPIC)?;
    for run in &runs {
        let range = run.start as usize..(run.start + run.len) as usize;
        writer.message(channel, &layout.message(cloud, range, &header.unit.to_string()))?;
    }
    let fail = |detail: String| Error::Encode { kind, detail };
    let runs = serde_json::to_string(&runs).map_err(|error| fail(error.to_string()))?;
    let mut all = vec![(RUNS_RECORD, runs)];
    all.extend(records.iter().cloned());
    let out = writer.finish(header, &all)?;
    out.into_inner().map(drop).map_err(|error| fail(error.to_string()))
}

/// Reads all points that [`encode_cloud`] wrote.
pub(super) fn decode_cloud(path: &Path, reader: &McapReader) -> Result<PointCloud, Error> {
    read_runs(path, reader, |_| true).map(|part| part.cloud)
}

/// Splits points in canonical order into the runs of their squares.
fn runs(cloud: &PointCloud) -> Vec<Run> {
    let corner = |index: usize| {
        let world = cloud.world(index);
        [(world[0] / RUN_M).floor() * RUN_M, (world[1] / RUN_M).floor() * RUN_M]
    };
    let mut runs: Vec<Run> = Vec::new();
    for index in 0..cloud.len() {
        let corner_m = corner(index);
        match runs.last_mut() {
            Some(run) if run.corner_m == corner_m => run.len += 1,
            _ => runs.push(Run { corner_m, start: index as u32, len: 1 }),
        }
    }
    debug_assert!(runs.windows(2).all(|pair| {
        morton(pair[0].corner_m[0], pair[0].corner_m[1])
            < morton(pair[1].corner_m[0], pair[1].corner_m[1])
    }));
    runs
}

fn read_runs(
    path: &Path,
    reader: &McapReader,
    wanted: impl Fn(&Run) -> bool,
) -> Result<Part, Error> {
    let runs: Vec<Run> = serde_json::from_str(&reader.record(RUNS_RECORD)?)
        .map_err(|error| Error::corrupt(path, RUNS_RECORD, error.to_string()))?;
    let frame = reader.header().facts.frame.unwrap_or_default();
    let mut part = Part { cloud: PointCloud::new(frame), index: Vec::new(), tile_len: 0 };
    part.tile_len = runs.iter().map(|run| run.len as usize).sum();
    for (number, run) in runs.iter().enumerate().filter(|(_, run)| wanted(run)) {
        let message = reader.message::<PointCloudMessage>(number)?;
        unpack(&message, &mut part.cloud)
            .map_err(|detail| Error::corrupt(path, &format!("chunk {number}"), detail))?;
        part.index.extend(run.start..run.start.saturating_add(run.len));
    }
    if part.index.len() == part.cloud.len() {
        return Ok(part);
    }
    let detail = format!("{} points where {} are announced", part.cloud.len(), part.index.len());
    Err(Error::corrupt(path, RUNS_RECORD, detail))
}

fn keep_inside(part: &mut Part, rect: &Rect) {
    let origin = part.cloud.frame.origin_m;
    let local = rect.moved([-(origin[0] as f64), -(origin[1] as f64)]);
    let inside: Vec<u32> = (0..part.cloud.len() as u32)
        .filter(|&i| {
            local.squared_distance(part.cloud.x[i as usize], part.cloud.y[i as usize]) <= 0.0
        })
        .collect();
    if inside.len() < part.cloud.len() {
        part.cloud = part.cloud.select(&inside);
        part.index = inside.iter().map(|&i| part.index[i as usize]).collect();
    }
}

/// Names and types of the fields of a packed point.
struct Layout {
    fields: Vec<PackedElementField>,
    stride: u32,
    wide: bool,
}

/// Name and type of the fields every cloud has, after x, y and z.
const FIXED: [(&str, NumericType); 8] = [
    ("gps_time", NumericType::Float64),
    ("scan_angle_deg", NumericType::Float32),
    ("intensity", NumericType::Uint16),
    ("source_id", NumericType::Uint16),
    ("return_number", NumericType::Uint8),
    ("number_of_returns", NumericType::Uint8),
    ("classification", NumericType::Uint8),
    ("flags", NumericType::Uint8),
];
/// Prefix of the names of extra columns.
const EXTRA_PREFIX: &str = "extra.";

fn size_of(numeric: NumericType) -> u32 {
    match numeric {
        NumericType::Unknown => 0,
        NumericType::Uint8 | NumericType::Int8 => 1,
        NumericType::Uint16 | NumericType::Int16 => 2,
        NumericType::Uint32 | NumericType::Int32 | NumericType::Float32 => 4,
        NumericType::Float64 => 8,
    }
}

fn type_of(column: &Column) -> NumericType {
    match column {
        Column::U8(_) => NumericType::Uint8,
        Column::I8(_) => NumericType::Int8,
        Column::U16(_) => NumericType::Uint16,
        Column::I16(_) => NumericType::Int16,
        Column::U32(_) => NumericType::Uint32,
        Column::I32(_) => NumericType::Int32,
        Column::F32(_) => NumericType::Float32,
        Column::F64(_) => NumericType::Float64,
    }
}

impl Layout {
    fn of(cloud: &PointCloud) -> Self {
        let wide = !fits_f32(cloud);
        let position = if wide { NumericType::Float64 } else { NumericType::Float32 };
        let mut layout = Self { fields: Vec::new(), stride: 0, wide };
        ["x", "y", "z"].iter().for_each(|name| layout.add((*name).to_owned(), position));
        FIXED.iter().for_each(|(name, numeric)| layout.add((*name).to_owned(), *numeric));
        for (name, column) in &cloud.extra {
            layout.add(format!("{EXTRA_PREFIX}{name}"), type_of(column));
        }
        layout
    }

    fn add(&mut self, name: String, numeric: NumericType) {
        self.fields.push(PackedElementField { name, offset: self.stride, r#type: numeric as i32 });
        self.stride += size_of(numeric);
    }

    fn message(
        &self,
        cloud: &PointCloud,
        range: std::ops::Range<usize>,
        frame_id: &str,
    ) -> PointCloudMessage {
        let mut data = Vec::with_capacity(range.len() * self.stride as usize);
        for index in range {
            self.pack(cloud, index, &mut data);
        }
        PointCloudMessage {
            timestamp: None,
            frame_id: frame_id.to_owned(),
            pose: Some(Pose {
                position: Some(foxglove::messages::Vector3 { x: 0.0, y: 0.0, z: 0.0 }),
                orientation: Some(foxglove::messages::Quaternion {
                    x: 0.0,
                    y: 0.0,
                    z: 0.0,
                    w: 1.0,
                }),
            }),
            point_stride: self.stride,
            fields: self.fields.clone(),
            data: data.into(),
        }
    }

    fn pack(&self, cloud: &PointCloud, index: usize, data: &mut Vec<u8>) {
        for value in cloud.local(index) {
            if self.wide {
                data.extend_from_slice(&value.to_le_bytes());
            } else {
                data.extend_from_slice(&(value as f32).to_le_bytes());
            }
        }
        let point = cloud.point(index);
        data.extend_from_slice(&point.gps_time.to_le_bytes());
        data.extend_from_slice(&point.scan_angle_deg.to_le_bytes());
        data.extend_from_slice(&point.intensity.to_le_bytes());
        data.extend_from_slice(&point.source_id.to_le_bytes());
        let bytes =
            [point.return_number, point.number_of_returns, point.classification, point.flags];
        data.extend_from_slice(&bytes);
        for column in cloud.extra.values() {
            pack_column(column, index, data);
        }
    }
}

fn pack_column(column: &Column, index: usize, data: &mut Vec<u8>) {
    match column {
        Column::U8(values) => data.push(values[index]),
        Column::I8(values) => data.extend_from_slice(&values[index].to_le_bytes()),
        Column::U16(values) => data.extend_from_slice(&values[index].to_le_bytes()),
        Column::I16(values) => data.extend_from_slice(&values[index].to_le_bytes()),
        Column::U32(values) => data.extend_from_slice(&values[index].to_le_bytes()),
        Column::I32(values) => data.extend_from_slice(&values[index].to_le_bytes()),
        Column::F32(values) => data.extend_from_slice(&values[index].to_le_bytes()),
        Column::F64(values) => data.extend_from_slice(&values[index].to_le_bytes()),
    }
}

/// Whether every position is recovered from `f32` by going back to the nearest lattice position.
fn fits_f32(cloud: &PointCloud) -> bool {
    let origin = cloud.frame.origin_m;
    [&cloud.x, &cloud.y, &cloud.z]
        .iter()
        .zip(origin)
        .all(|(values, origin)| values.iter().all(|v| to_lattice(*v as f32, origin) == *v))
}

/// The lattice position nearest to a stored `f32`, local again.
fn to_lattice(stored: f32, origin: i64) -> f64 {
    quantise(f64::from(stored) + origin as f64) - origin as f64
}

/// Reads `N` bytes of a packed field of every point.
struct Packed<'a> {
    data: &'a [u8],
    stride: usize,
}

impl Packed<'_> {
    fn values<const N: usize, T>(&self, offset: usize, from: impl Fn([u8; N]) -> T) -> Vec<T> {
        let points = self.data.chunks_exact(self.stride);
        points.map(|point| from(std::array::from_fn(|i| point[offset + i]))).collect()
    }

    fn column(&self, offset: usize, numeric: NumericType) -> Option<Column> {
        Some(match numeric {
            NumericType::Unknown => return None,
            NumericType::Uint8 => Column::U8(self.values(offset, u8::from_le_bytes)),
            NumericType::Int8 => Column::I8(self.values(offset, i8::from_le_bytes)),
            NumericType::Uint16 => Column::U16(self.values(offset, u16::from_le_bytes)),
            NumericType::Int16 => Column::I16(self.values(offset, i16::from_le_bytes)),
            NumericType::Uint32 => Column::U32(self.values(offset, u32::from_le_bytes)),
            NumericType::Int32 => Column::I32(self.values(offset, i32::from_le_bytes)),
            NumericType::Float32 => Column::F32(self.values(offset, f32::from_le_bytes)),
            NumericType::Float64 => Column::F64(self.values(offset, f64::from_le_bytes)),
        })
    }
}

/// Appends the points of a message. The error says which field does not fit.
fn unpack(message: &PointCloudMessage, cloud: &mut PointCloud) -> Result<(), String> {
    let stride = message.point_stride as usize;
    if stride == 0 || !message.data.len().is_multiple_of(stride) {
        return Err(format!("{} bytes are no multiple of {stride}", message.data.len()));
    }
    let packed = Packed { data: &message.data, stride };
    let mut read = PointCloud::new(cloud.frame);
    for field in &message.fields {
        let (offset, numeric) = (field.offset as usize, field.r#type());
        if offset + size_of(numeric) as usize > stride {
            return Err(format!("field `{}` lies beyond the point", field.name));
        }
        let column = packed
            .column(offset, numeric)
            .ok_or_else(|| format!("field `{}` has no type", field.name))?;
        place(&mut read, &field.name, column)?;
    }
    read.validate().map_err(|error| error.to_string())?;
    cloud.append(&read).map_err(|error| error.to_string())
}

/// Puts an unpacked field where it belongs.
fn place(cloud: &mut PointCloud, name: &str, column: Column) -> Result<(), String> {
    let origin = cloud.frame.origin_m;
    let metres = |column: Column, origin: i64| match column {
        Column::F64(values) => Some(values),
        Column::F32(values) => Some(values.into_iter().map(|v| to_lattice(v, origin)).collect()),
        _ => None,
    };
    let kind = column.type_name();
    let wrong = || format!("field `{name}` is {kind}");
    match (name, column) {
        ("x", column) => cloud.x = metres(column, origin[0]).ok_or_else(wrong)?,
        ("y", column) => cloud.y = metres(column, origin[1]).ok_or_else(wrong)?,
        ("z", column) => cloud.z = metres(column, origin[2]).ok_or_else(wrong)?,
        ("gps_time", Column::F64(values)) => cloud.gps_time = values,
        ("scan_angle_deg", Column::F32(values)) => cloud.scan_angle_deg = values,
        ("intensity", Column::U16(values)) => cloud.intensity = values,
        ("source_id", Column::U16(values)) => cloud.source_id = values,
        ("return_number", Column::U8(values)) => cloud.return_number = values,
        ("number_of_returns", Column::U8(values)) => cloud.number_of_returns = values,
        ("classification", Column::U8(values)) => cloud.classification = values,
        ("flags", Column::U8(values)) => cloud.flags = values,
        (name, column) => {
            let extra = name.strip_prefix(EXTRA_PREFIX).ok_or_else(wrong)?;
            cloud.extra.insert(extra.to_owned(), column);
        }
    }
    Ok(())
}
