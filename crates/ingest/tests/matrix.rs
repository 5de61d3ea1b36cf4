//! Files of every LAS version and point format, plain and compressed, written by the `las` crate
//! and read back.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use las::point::{Classification, Format, ScanDirection};
use las::{Builder, Color, Point, Transform, Vector, Version, Writer};
use std::io::Cursor;
use timberline_ingest::{LasFile, UnitChoice};
use timberline_pointcloud::{Column, PointCloud};

const COUNT: i32 = 500;

/// Formats that a version allows, and the first compressed ones.
fn matrix() -> Vec<(u8, u8, bool)> {
    let formats = |minor: u8| match minor {
        0 | 1 => 0..=1,
        2 => 0..=3,
        3 => 0..=5,
        _ => 0..=10,
    };
    (0..=4)
        .flat_map(|minor| formats(minor).map(move |format| (minor, format)))
        .flat_map(|(minor, format)| [(minor, format, false), (minor, format, true)])
        .collect()
}

fn point(i: i32, format: &Format) -> Point {
    let f = f64::from(i);
    Point {
        x: 481_200.0 + f * 0.13,
        y: 3_813_000.0 - f * 0.07,
        z: 120.0 + f64::from(i * 37 % 900) * 0.01,
        intensity: (i * 131 % 65_536) as u16,
        return_number: (i % 3 + 1) as u8,
        number_of_returns: 3,
        scan_direction: if i % 2 == 0 {
            ScanDirection::LeftToRight
        } else {
            ScanDirection::RightToLeft
        },
        is_edge_of_flight_line: i % 5 == 0,
        classification: Classification::new([1, 2, 5, 7][(i % 4) as usize]).unwrap(),
        is_synthetic: i % 7 == 0,
        is_key_point: i % 11 == 0,
        is_withheld: i % 13 == 0,
        scan_angle: f32::from((i % 40 - 20) as i16),
        user_data: (i % 200) as u8,
        point_source_id: (i % 9) as u16,
        gps_time: format.has_gps_time.then_some(2.6e8 + f * 1e-4),
        color: format.has_color.then(|| Color::new(i as u16, (2 * i) as u16, 65_000)),
        nir: format.has_nir.then_some((3 * i) as u16),
        waveform: format.has_waveform.then(Default::default),
        ..Point::default()
    }
}

fn write(minor: u8, format: u8, compressed: bool) -> (Vec<u8>, Vec<Point>) {
    let mut format = Format::new(format).unwrap();
    format.is_compressed = compressed;
    let mut builder = Builder::from(Version::new(1, minor));
    builder.point_format = format;
    let axis = |offset: f64| Transform { scale: 0.01, offset };
    builder.transforms = Vector { x: axis(480_000.0), y: axis(3_800_000.0), z: axis(0.0) };
    let points: Vec<Point> = (0..COUNT).map(|i| point(i, &format)).collect();
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    points.iter().for_each(|point| writer.write_point(point.clone()).unwrap());
    (writer.into_inner().unwrap().into_inner(), points)
}

fn read(bytes: Vec<u8>) -> PointCloud {
    let source = Box::new(Cursor::new(bytes));
    let mut file = LasFile::from_source(source, UnitChoice::default(), None).unwrap();
    let mut cloud = PointCloud::default();
    while let Some(batch) = file.next_batch().unwrap() {
        cloud.append(&batch).unwrap();
    }
    assert!(file.damage().is_none());
    cloud
}

fn check(found: &PointCloud, i: usize, point: &Point, name: &str) {
    let at = found.world(i);
    let expected = [point.x, point.y, point.z];
    assert!((0..3).all(|a| (at[a] - expected[a]).abs() < 0.005 + 1e-9), "{name}: {at:?}");
    let p = found.point(i);
    assert_eq!((p.intensity, p.source_id), (point.intensity, point.point_source_id), "{name}");
    assert_eq!((p.return_number, p.number_of_returns), (point.return_number, 3), "{name}");
    assert_eq!(p.classification, u8::from(point.classification), "{name}");
    let flags = u8::from(point.is_synthetic)
        | u8::from(point.is_key_point) << 1
        | u8::from(point.is_withheld) << 2
        | u8::from(point.is_edge_of_flight_line) << 4
        | u8::from(point.scan_direction == ScanDirection::LeftToRight) << 5;
    assert_eq!(p.flags, flags, "{name} point {i}");
    assert!((p.scan_angle_deg - point.scan_angle).abs() < 0.0061, "{name}");
    match point.gps_time {
        Some(time) => assert_eq!(p.gps_time, time, "{name}"),
        None => assert!(p.gps_time.is_nan(), "{name}"),
    }
}

#[test]
fn every_version_and_format_reads_back() {
    for (minor, format, compressed) in matrix() {
        let name = format!("LAS 1.{minor} format {format}{}", if compressed { " LAZ" } else { "" });
        let (bytes, points) = write(minor, format, compressed);
        let found = read(bytes);
        assert_eq!(found.len(), points.len(), "{name}");
        points.iter().enumerate().for_each(|(i, point)| check(&found, i, point, &name));
        let layout = Format::new(format).unwrap();
        let column = |name: &str| found.extra.get(name).cloned();
        let values = |value: fn(&Point) -> Option<u16>| {
            points.iter().map(value).collect::<Option<Vec<u16>>>().map(Column::U16)
        };
        assert_eq!(column("red"), values(|p| p.color.map(|c| c.red)), "{name}");
        assert_eq!(column("blue"), values(|p| p.color.map(|c| c.blue)), "{name}");
        assert_eq!(column("nir"), values(|p| p.nir), "{name}");
        assert_eq!(column("red").is_some(), layout.has_color, "{name}");
        let user = points.iter().map(|p| p.user_data).collect();
        assert_eq!(column("user_data"), Some(Column::U8(user)), "{name}");
    }
}
