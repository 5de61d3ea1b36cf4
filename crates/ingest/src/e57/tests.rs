use crate::{Scan, UnitChoice, scan};
use ::e57::{
    E57Writer, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform, Translation,
};
use proptest::prelude::*;
use std::io::Cursor;
use timberline_pointcloud::{Column, PointCloud};

fn open(bytes: Vec<u8>) -> Result<Box<dyn Scan>, crate::Error> {
    scan::from_source(Box::new(Cursor::new(bytes)), UnitChoice::default(), None)
}

fn read(bytes: Vec<u8>) -> (PointCloud, Box<dyn Scan>) {
    let mut file = open(bytes).unwrap();
    let mut cloud = PointCloud::default();
    while let Some(batch) = file.next_batch().unwrap() {
        cloud.append(&batch).unwrap();
    }
    cloud.validate().unwrap();
    (cloud, file)
}

fn record(name: RecordName, data_type: RecordDataType) -> Record {
    Record { name, data_type }
}

fn integer(min: i64, max: i64) -> RecordDataType {
    RecordDataType::Integer { min, max }
}

/// A quarter turn to the left, then a step to georeferenced coordinates.
fn pose() -> Transform {
    let half = 0.5f64.sqrt();
    Transform {
        rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
        translation: Translation { x: 500_000.0, y: 5_400_000.0, z: 300.0 },
    }
}

/// Two scans: Cartesian with everything, spherical with a pose.
fn two_scans(count: i64) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").unwrap();
    let scaled =
        RecordDataType::ScaledInteger { min: -1 << 40, max: 1 << 40, scale: 1e-4, offset: 0.0 };
    let prototype = vec![
        record(RecordName::CartesianX, scaled.clone()),
        record(RecordName::CartesianY, scaled.clone()),
        record(RecordName::CartesianZ, scaled),
        record(RecordName::CartesianInvalidState, integer(0, 2)),
        record(RecordName::Intensity, RecordDataType::Single { min: Some(-10.0), max: Some(10.0) }),
        record(RecordName::IsIntensityInvalid, integer(0, 1)),
        record(RecordName::ColorRed, integer(0, 255)),
        record(RecordName::ColorGreen, integer(0, 255)),
        record(RecordName::ColorBlue, integer(0, 255)),
        record(RecordName::ReturnIndex, integer(0, 7)),
        record(RecordName::ReturnCount, integer(0, 7)),
        record(RecordName::TimeStamp, RecordDataType::F64),
    ];
    let mut scan = writer.add_pointcloud("one", prototype).unwrap();
    for i in 0..count {
        let state = i64::from(i % 5 == 4) * 2;
        scan.add_point(vec![
            RecordValue::ScaledInteger(i * 10_000),
            RecordValue::ScaledInteger(-25_000),
            RecordValue::ScaledInteger(i * 5),
            RecordValue::Integer(state),
            RecordValue::Single(if i == 0 { -10.0 } else { 10.0 }),
            RecordValue::Integer(i64::from(i == 1)),
            RecordValue::Integer(255),
            RecordValue::Integer(i % 256),
            RecordValue::Integer(0),
            RecordValue::Integer(i % 2),
            RecordValue::Integer(2),
            RecordValue::Double(i as f64 * 0.5),
        ])
        .unwrap();
    }
    scan.finalize().unwrap();
    let prototype = vec![
        record(RecordName::SphericalRange, RecordDataType::F64),
        record(RecordName::SphericalAzimuth, RecordDataType::F64),
        record(RecordName::SphericalElevation, RecordDataType::F64),
        record(RecordName::SphericalInvalidState, integer(0, 2)),
    ];
    let mut scan = writer.add_pointcloud("two", prototype).unwrap();
    scan.set_transform(Some(pose()));
    for i in 0..count {
        scan.add_point(vec![
            RecordValue::Double(2.0),
            RecordValue::Double(0.0),
            RecordValue::Double(std::f64::consts::FRAC_PI_6),
            RecordValue::Integer(i64::from(i == 0)),
        ])
        .unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    out.into_inner()
}

#[test]
fn scans_are_posed_numbered_and_freed_of_invalid_points() {
    let (cloud, scan) = read(two_scans(10));
    assert_eq!((scan.container(), scan.damages().len(), cloud.len()), ("E57", 0, 8 + 9));
    assert_eq!(cloud.world(7), [8.0, -2.5, 0.004]);
    assert_eq!(cloud.intensity[..3], [0, 0, 65_535]);
    assert_eq!(cloud.extra["red"].value(0), 65_535.0);
    assert_eq!((cloud.return_number[..2].to_vec(), cloud.number_of_returns[0]), (vec![1, 2], 2));
    assert_eq!((cloud.gps_time[2], cloud.gps_time[8].is_nan()), (1.0, true));
    assert_eq!((cloud.source_id[0], cloud.source_id[8]), (1, 2));
    // 2 m at 30 degrees up, to the east of the scanner, which is turned to the north.
    assert_eq!(cloud.world(9), [500_000.0, 5_400_001.732_1, 301.0]);
    assert_eq!(
        cloud.extra["green"],
        Column::U16((0..10).filter(|i| i % 5 < 4).map(|i| i * 257).chain([0; 9]).collect())
    );
    let notes = scan.notes().messages();
    assert!(notes[0].contains("scan 1: 2 of 10 points are marked as invalid"), "{notes:?}");
}

/// A page that does not fit its checksum costs the rest of its scan; the next scan is read.
#[test]
fn a_bad_page_costs_the_rest_of_its_scan() {
    let mut bytes = two_scans(20_000);
    bytes[300 * 1024 + 7] ^= 0x10;
    let (cloud, scan) = read(bytes);
    let message = scan.damage().unwrap().to_string();
    let first = cloud.source_id.iter().filter(|id| **id == 1).count();
    assert!(first > 1000 && first < 15_000, "{first}");
    assert_eq!(cloud.source_id.iter().filter(|id| **id == 2).count(), 19_999);
    assert!(message.contains("scan 1, record") && message.contains("checksum"), "{message}");
    assert!(message.contains("page 300"), "{message}");
}

#[test]
fn what_is_no_file_any_more_is_refused() {
    let bytes = two_scans(300);
    let cut = bytes[..bytes.len() - 1000].to_vec();
    let message = open(cut).map(drop).unwrap_err().to_string();
    assert!(message.contains("E57 header") && message.contains("truncated"), "{message}");
    let mut xml = bytes.clone();
    let at = bytes.len() - 500;
    xml[at] ^= 1;
    let message = open(xml).map(drop).unwrap_err().to_string();
    assert!(message.contains("checksum"), "{message}");
}

/// The crate would fill the memory: no value takes a bit, so nothing says how many there are.
#[test]
fn a_scan_of_constants_is_damage() {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").unwrap();
    let names = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
    let prototype = names.map(|name| record(name, integer(3, 4))).to_vec();
    let mut scan = writer.add_pointcloud("one", prototype).unwrap();
    scan.add_point(vec![RecordValue::Integer(3), RecordValue::Integer(3), RecordValue::Integer(4)])
        .unwrap();
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    let mut bytes = out.into_inner();
    // The crate's writer refuses to write such a scan.
    let wrong = b"maximum=\"4\"";
    while let Some(at) = bytes.windows(wrong.len()).position(|window| window == wrong) {
        bytes[at + 9] = b'3';
    }
    crate::testing::seal_e57(&mut bytes);
    let (cloud, scan) = read(bytes);
    let message = scan.damage().unwrap().to_string();
    assert!(cloud.is_empty() && message.contains("declared to be the same"), "{message}");
}

#[test]
fn a_file_dropped_early_does_not_hang() {
    let mut file = open(two_scans(200_000)).unwrap();
    assert!(file.next_batch().unwrap().is_some());
    drop(file);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Whatever is changed in a file, it is read or refused. Checksums are made right again.
    #[test]
    fn changed_bytes_never_panic(
        changes in prop::collection::vec((0usize..10_000, any::<u8>()), 1..6),
    ) {
        let mut bytes = two_scans(50);
        for (place, value) in changes {
            let place = place % bytes.len();
            bytes[place] = value;
        }
        crate::testing::seal_e57(&mut bytes);
        if let Ok(mut file) = open(bytes) {
            while let Ok(Some(cloud)) = file.next_batch() {
                cloud.validate().unwrap();
            }
        }
    }
}
