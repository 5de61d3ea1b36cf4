//! What a program is given: points as LAZ, trees as CSV.

use super::layout::{RECORD, USER, descriptor};
use super::{Failure, Request};
use las::point::Format;
use las::{Builder, GpsTimeType, PointDataBuilder, Transform, Vector, Vlr, Writer};
use std::fmt::Write as _;
use std::io::Cursor;
use std::path::Path;
use timberline_artefact::Crs;

/// File names.
pub(super) const POINTS: &str = "in.laz";
pub(super) const TOPS: &str = "tops.csv";

/// Smallest step of a coordinate: positions in metres are exact.
pub(super) const SCALE: f64 = 0.0001;
/// Bytes of `height` (f32) and `own` (u8) in a record.
const EXTRA: u16 = 5;
const U8: u8 = 1;
const F32: u8 = 9;
/// ASPRS classes.
const UNCLASSIFIED: u8 = 1;
const GROUND: u8 = 2;

/// Writes the points: LAS 1.4, point format 6.
pub(super) fn points(request: &Request<'_>, path: &Path) -> Result<(), Failure> {
    // In memory: a writer of the `las` crate that is dropped on a full disk panics.
    let bytes =
        laz(request).map_err(|detail| Failure::Give { path: path.to_path_buf(), detail })?;
    std::fs::write(path, bytes).map_err(Failure::io(path, "write"))
}

fn laz(request: &Request<'_>) -> Result<Vec<u8>, String> {
    let words = |error: las::Error| error.to_string();
    let header = header(request).into_header().map_err(words)?;
    let mut writer = Writer::new(Cursor::new(Vec::new()), header).map_err(words)?;
    let mut records = Vec::new();
    for index in 0..request.cloud.len() {
        push(&mut records, request, index)?;
    }
    let slab = PointDataBuilder::new().for_header(writer.header());
    writer.write_points(&slab.build_from_bytes(records).map_err(words)?).map_err(words)?;
    Ok(writer.into_inner().map_err(words)?.into_inner())
}

fn header(request: &Request<'_>) -> Builder {
    let offset = offset(request);
    let transform = |axis: usize| Transform { scale: SCALE, offset: offset[axis] };
    let mut builder = Builder::from((1, 4));
    builder.point_format = Format {
        has_gps_time: true,
        is_extended: true,
        extra_bytes: EXTRA,
        is_compressed: true,
        ..Format::default()
    };
    builder.transforms = Vector { x: transform(0), y: transform(1), z: transform(2) };
    "Timberline".clone_into(&mut builder.generating_software);
    "EXTRACTION".clone_into(&mut builder.system_identifier);
    builder.gps_time_type = GpsTimeType::Standard;
    builder.vlrs = records(request.crs);
    builder
}

/// A round number near the points, in units of the system.
fn offset(request: &Request<'_>) -> [f64; 3] {
    let origin = request.cloud.frame.origin_m.map(|value| value as f64);
    request.crs.crs_from_world(origin).map(f64::floor)
}

fn records(crs: &Crs) -> Vec<Vlr> {
    let record = |user: &str, id: u16, description: &str, data: Vec<u8>| Vlr {
        user_id: user.to_owned(),
        record_id: id,
        description: description.to_owned(),
        data,
    };
    let extra = [
        descriptor("height", F32, "above ground, m"),
        descriptor("own", U8, "1 tile, 0 surroundings"),
    ];
    let system = wkt(crs)
        .map(|wkt| record("LASF_Projection", 2112, "OGC WKT", [wkt.as_bytes(), b"\0"].concat()));
    system.into_iter().chain([record(USER, RECORD, "Extra bytes", extra.concat())]).collect()
}

/// The system's text as it came, or the public definition of its code.
fn wkt(crs: &Crs) -> Option<String> {
    let given = crs.wkt.as_deref().map(|text| text.trim_end_matches('\0').trim());
    let code = || u16::try_from(crs.epsg?).ok();
    match given.filter(|text| !text.is_empty()) {
        Some(text) => Some(text.to_owned()),
        None => Some(crs_definitions::from_code(code()?)?.wkt.to_owned()),
    }
}

/// The steps of a position on the lattice of the file.
pub(super) fn steps(request: &Request<'_>, index: usize) -> [f64; 3] {
    let position = request.crs.crs_from_world(request.cloud.world(index));
    let offset = offset(request);
    std::array::from_fn(|axis| ((position[axis] - offset[axis]) / SCALE).round())
}

/// A position as the file has it.
pub(super) fn position(request: &Request<'_>, index: usize) -> [f64; 3] {
    let offset = offset(request);
    let steps = steps(request, index);
    std::array::from_fn(|axis| steps[axis] * SCALE + offset[axis])
}

/// Appends the record of a point (table 14, point format 6), then its extra bytes.
fn push(bytes: &mut Vec<u8>, request: &Request<'_>, index: usize) -> Result<(), String> {
    let cloud = request.cloud;
    for steps in steps(request, index) {
        if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&steps) {
            return Err(format!("point {index} is too far from the corner of the tile"));
        }
        bytes.extend((steps as i32).to_le_bytes());
    }
    let point = cloud.point(index);
    bytes.extend(point.intensity.to_le_bytes());
    bytes.push(point.return_number.min(15) | point.number_of_returns.min(15) << 4);
    let (edge, direction) = (point.flags >> 4 & 1, point.flags >> 5 & 1);
    bytes.push(point.flags & 0x0F | direction << 6 | edge << 7);
    bytes.push(class(point.classification, request.is_ground[index]));
    bytes.push(0);
    bytes.extend(((point.scan_angle_deg / 0.006).round() as i16).to_le_bytes());
    bytes.extend(point.source_id.to_le_bytes());
    let time = if point.gps_time.is_nan() { 0.0 } else { point.gps_time };
    bytes.extend(time.to_le_bytes());
    bytes.extend(request.height_m[index].to_le_bytes());
    bytes.push(u8::from(request.own[index]));
    Ok(())
}

/// The class of a point: ground is what the pipeline's ground filter takes for it.
fn class(original: u8, is_ground: bool) -> u8 {
    match (is_ground, original) {
        (true, _) => GROUND,
        (false, GROUND) => UNCLASSIFIED,
        (false, class) => class,
    }
}

/// Writes the trees, sorted by id.
pub(super) fn tops(request: &Request<'_>, path: &Path) -> Result<(), Failure> {
    let mut text = String::from("id,x,y,z,height_m,radius_m,score\n");
    for marker in request.markers {
        let world = request.cloud.frame.world_from_local(marker.crown.apex);
        let [x, y, z] = request.crs.crs_from_world(world);
        let (id, height, radius) = (marker.crown.id, marker.height_m, marker.crown.radius_m);
        let score = marker.score;
        // Writing to a string cannot fail.
        writeln!(text, "{id},{x:.4},{y:.4},{z:.4},{height:.3},{radius:.3},{score:.3}")
            .unwrap_or_default();
    }
    std::fs::write(path, text).map_err(Failure::io(path, "write"))
}
