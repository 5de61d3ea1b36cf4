//! Any bytes as an E57 file; checksums of its pages are made right, or nothing would get past them.
#![no_main]

mod clouds;

use e57::{
    E57Writer, Quaternion, Record, RecordDataType, RecordName, RecordValue, Transform, Translation,
};
use libfuzzer_sys::fuzz_target;
use std::io::Cursor;

fuzz_target!(
    init: {
        match seed() {
            Ok(seed) => clouds::write_seeds("e57_reader", &[("two-scans", seed)]),
            Err(error) => eprintln!("no seeds: {error}"),
        }
    },
    |bytes: &[u8]| {
        let mut bytes = bytes.to_vec();
        seal(&mut bytes);
        clouds::run(&bytes);
    }
);

/// CRC-32C of the first 1020 of 1024 bytes, most significant byte first.
fn seal(bytes: &mut [u8]) {
    for page in bytes.chunks_exact_mut(1024) {
        let mut crc = u32::MAX;
        for byte in &page[..1020] {
            crc ^= u32::from(*byte);
            for _ in 0..8 {
                crc = (crc >> 1) ^ (0x82F6_3B78 & (crc & 1).wrapping_neg());
            }
        }
        page[1020..].copy_from_slice(&(!crc).to_be_bytes());
    }
}

fn seed() -> e57::Result<Vec<u8>> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file")?;
    let whole = |min: i64, max: i64| RecordDataType::Integer { min, max };
    let record = |name: RecordName, data_type: RecordDataType| Record { name, data_type };
    let prototype = vec![
        record(RecordName::CartesianX, RecordDataType::F64),
        record(RecordName::CartesianY, RecordDataType::F32),
        record(
            RecordName::CartesianZ,
            RecordDataType::ScaledInteger { min: 0, max: 5000, scale: 0.001, offset: 1.0 },
        ),
        record(RecordName::CartesianInvalidState, whole(0, 2)),
        record(RecordName::Intensity, RecordDataType::UNIT_F32),
    ];
    let mut scan = writer.add_pointcloud("one", prototype)?;
    for i in 0..20 {
        scan.add_point(vec![
            RecordValue::Double(i as f64),
            RecordValue::Single(i as f32),
            RecordValue::ScaledInteger(i),
            RecordValue::Integer(i % 3),
            RecordValue::Single(0.5),
        ])?;
    }
    scan.finalize()?;
    let prototype = vec![
        record(RecordName::SphericalRange, RecordDataType::F64),
        record(RecordName::SphericalAzimuth, RecordDataType::F64),
        record(RecordName::SphericalElevation, RecordDataType::F64),
        record(RecordName::ColorRed, RecordDataType::U8),
        record(RecordName::ColorGreen, RecordDataType::U8),
        record(RecordName::ColorBlue, RecordDataType::U8),
    ];
    let mut scan = writer.add_pointcloud("two", prototype)?;
    scan.set_transform(Some(Transform {
        rotation: Quaternion { w: 0.6, x: 0.0, y: 0.0, z: 0.8 },
        translation: Translation { x: 1.0, y: 2.0, z: 3.0 },
    }));
    for i in 0..20i64 {
        let byte = || RecordValue::Integer(i * 9);
        let angle = || RecordValue::Double(i as f64 * 0.05);
        scan.add_point(vec![RecordValue::Double(7.0), angle(), angle(), byte(), byte(), byte()])?;
    }
    scan.finalize()?;
    writer.finalize()?;
    drop(writer);
    Ok(out.into_inner())
}
