//! What is written as LAS or LAZ is what the `las` crate reads back.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use las::Reader;
use proptest::prelude::*;
use std::path::Path;
use timberline_artefact::Crs;
use timberline_export::las::{
    Colour, Dimension, DimensionType, LasOptions, LasVersion, offset_for, write_las,
};
use timberline_pointcloud::{Column, Frame, Point, PointCloud};

fn dimension(name: &str, kind: DimensionType) -> Dimension {
    Dimension { name: name.to_owned(), kind, description: format!("the {name}") }
}

/// A cloud with every attribute used, from small numbers.
fn cloud(seeds: &[(i32, i32, i32, u16)]) -> PointCloud {
    let mut cloud = PointCloud::new(Frame::new([481_000, 3_812_000, -5]));
    for (x, y, z, seed) in seeds {
        let returns = (seed % 5 + 1) as u8;
        let point = Point {
            intensity: *seed,
            return_number: returns,
            number_of_returns: 7,
            classification: (seed % 32) as u8,
            flags: (seed % 8) as u8 + (seed / 8 % 4) as u8 * 16,
            scan_angle_deg: f32::from((seed % 41) as u8) - 20.0,
            gps_time: f64::from(*seed) * 0.25,
            source_id: seed ^ 0x55,
        };
        let world = [(*x, 481_000), (*y, 3_812_000), (*z, 0)];
        cloud.push_world(
            world.map(|(value, base)| f64::from(base) + f64::from(value) / 1000.0),
            &point,
        );
    }
    let of = |f: &dyn Fn(u16) -> f64| seeds.iter().map(|s| f(s.3)).collect::<Vec<f64>>();
    let id = of(&|seed| f64::from(seed) * 1e11 + 1.0);
    let height = seeds.iter().map(|s| f32::from(s.3) * 0.01).collect();
    cloud.extra.insert("treeID".into(), Column::F64(id));
    cloud.extra.insert("HeightAboveGround".into(), Column::F32(height));
    let bytes = |f: &dyn Fn(u16) -> u8| Column::U8(seeds.iter().map(|s| f(s.3)).collect());
    cloud.extra.insert("user_data".into(), bytes(&|seed| (seed % 251) as u8));
    cloud.extra.insert("scanner_channel".into(), bytes(&|seed| (seed % 4) as u8));
    for (name, shift) in [("red", 0), ("green", 3), ("blue", 6), ("nir", 9)] {
        let values = seeds.iter().map(|s| s.3.rotate_left(shift)).collect();
        cloud.extra.insert(name.into(), Column::U16(values));
    }
    cloud
}

fn options(version: LasVersion, colour: Colour) -> LasOptions {
    LasOptions {
        version,
        colour,
        offset: [480_000.0, 3_812_000.0, 0.0],
        dimensions: vec![
            dimension("HeightAboveGround", DimensionType::F32),
            dimension("treeID", DimensionType::F64),
        ],
        ..LasOptions::default()
    }
}

/// Reads a file with the `las` crate and compares every attribute.
fn check(path: &Path, expected: &PointCloud, colour: Colour) {
    let mut reader = Reader::from_path(path).unwrap();
    let points: Vec<las::Point> = reader.read_all().unwrap().points().map(Result::unwrap).collect();
    assert_eq!(points.len(), expected.len());
    for (index, found) in points.iter().enumerate() {
        let (wanted, world) = (expected.point(index), expected.world(index));
        for (found, wanted) in [found.x, found.y, found.z].iter().zip(world) {
            assert!((found - wanted).abs() < 1e-6, "{found} instead of {wanted}");
        }
        assert_eq!(found.intensity, wanted.intensity);
        assert_eq!(found.return_number, wanted.return_number);
        assert_eq!(found.number_of_returns, wanted.number_of_returns);
        assert_eq!(u8::from(found.classification), wanted.classification);
        assert_eq!(found.is_synthetic, wanted.flags & 1 != 0);
        assert_eq!(found.is_key_point, wanted.flags & 2 != 0);
        assert_eq!(found.is_withheld, wanted.flags & 4 != 0);
        assert_eq!(found.is_edge_of_flight_line, wanted.flags & 16 != 0);
        assert_eq!(
            found.scan_direction == las::point::ScanDirection::LeftToRight,
            wanted.flags & 32 != 0
        );
        assert!((found.scan_angle - wanted.scan_angle_deg).abs() < 0.006);
        assert_eq!(found.gps_time, Some(wanted.gps_time));
        assert_eq!(found.point_source_id, wanted.source_id);
        let of = |name: &str| expected.extra[name].value(index) as u16;
        assert_eq!(u16::from(found.user_data), of("user_data"));
        let modern = reader.header().version().minor == 4;
        assert_eq!(
            u16::from(found.scanner_channel),
            if modern { of("scanner_channel") } else { 0 }
        );
        let rgb = las::Color::new(of("red"), of("green"), of("blue"));
        assert_eq!(found.color, (colour > Colour::None).then_some(rgb));
        assert_eq!(found.nir, (colour == Colour::RgbNir).then(|| of("nir")));
        let height = f32::from_le_bytes(found.extra_bytes[..4].try_into().unwrap());
        let id = f64::from_le_bytes(found.extra_bytes[4..].try_into().unwrap());
        assert_eq!(f64::from(height), expected.extra["HeightAboveGround"].value(index));
        assert_eq!(id, expected.extra["treeID"].value(index));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]
    #[test]
    fn every_attribute_comes_back(
        seeds in prop::collection::vec((-90_000i32..90_000, -90_000i32..90_000, -9_000i32..90_000, 0u16..=65535), 1..300),
        modern in any::<bool>(), compressed in any::<bool>(), colour in 0..3,
    ) {
        // Class 12 is the overlap flag of old formats and read back as one.
        let seeds: Vec<_> = seeds.into_iter().filter(|s| s.3 % 32 != 12).collect();
        let version = if modern { LasVersion::V1_4 } else { LasVersion::V1_2 };
        let asked = [Colour::None, Colour::Rgb, Colour::RgbNir][colour as usize];
        let colour = if modern { asked } else { asked.min(Colour::Rgb) };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(if compressed { "t.laz" } else { "t.las" });
        let cloud = cloud(&seeds);
        let crs = Crs { epsg: Some(32611), ..Crs::default() };
        let points = write_las(&path, std::slice::from_ref(&cloud), &crs, &options(version, asked)).unwrap();
        prop_assert_eq!(points as usize, cloud.len());
        check(&path, &cloud, colour);
    }
}

fn many(points: usize) -> PointCloud {
    let seeds: Vec<_> =
        (0..points as i32).map(|i| (i % 977, i % 1013, i % 37, (i % 65_521) as u16)).collect();
    cloud(&seeds)
}

#[test]
fn the_bytes_depend_on_the_points_only() {
    let folder = tempfile::tempdir().unwrap();
    let crs = Crs { epsg: Some(32611), ..Crs::default() };
    let options = options(LasVersion::V1_4, Colour::None);
    let whole = many(130_000);
    let parts: Vec<PointCloud> = [0..20_000_u32, 20_000..20_001, 20_001..130_000]
        .into_iter()
        .map(|range| whole.select(&range.collect::<Vec<_>>()))
        .collect();
    let bytes = |name: &str, clouds: &[PointCloud], threads: usize| {
        let path = folder.path().join(name);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| write_las(&path, clouds, &crs, &options)).unwrap();
        std::fs::read(path).unwrap()
    };
    let reference = bytes("a.laz", std::slice::from_ref(&whole), 2);
    assert_eq!(bytes("b.laz", &parts, 1), reference);
    assert_eq!(bytes("c.laz", &parts, 3), reference);
}

#[test]
fn feet_go_back_to_feet() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.laz");
    let foot = 1200.0 / 3937.0;
    let crs = Crs { horizontal_m_per_unit: foot, vertical_m_per_unit: foot, ..Crs::default() };
    let mut cloud = PointCloud::new(Frame::new([600_000, 100_000, 0]));
    let feet = [2_000_123.45, 400_987.65, 321.09];
    cloud.push_world(
        crs.world_from_crs(feet).map(timberline_pointcloud::frame::quantise),
        &Point::default(),
    );
    let offset = offset_for(&crs, cloud.world(0));
    assert_eq!(offset, [2_000_000.0, 400_000.0, 0.0]);
    write_las(&path, &[cloud], &crs, &LasOptions { offset, ..LasOptions::default() }).unwrap();
    let point = first_point(&path);
    for (found, wanted) in [point.x, point.y, point.z].iter().zip(feet) {
        assert!((found - wanted).abs() < 0.0011, "{found} instead of {wanted}");
    }
}

#[test]
fn what_does_not_fit_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.las");
    let mut cloud = PointCloud::new(Frame::default());
    cloud.push_world([9e6, 0.0, 0.0], &Point { number_of_returns: 9, ..Point::default() });
    let crs = Crs::default();
    let far = write_las(&path, std::slice::from_ref(&cloud), &crs, &LasOptions::default());
    assert!(far.unwrap_err().to_string().contains("coordinate 9000000 of axis x"));
    let old = LasOptions { version: LasVersion::V1_2, scale: 0.01, ..LasOptions::default() };
    let many = write_las(&path, &[cloud], &crs, &old);
    assert!(many.unwrap_err().to_string().contains("number of returns 9 does not fit LAS 1.2"));
    assert!(!path.exists());
}

fn first_point(path: &Path) -> las::Point {
    Reader::from_path(path).unwrap().read_all().unwrap().points().next().unwrap().unwrap()
}
