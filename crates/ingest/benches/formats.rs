//! Reading a million points of each format into columns in metres.
//!
//! On one thread, so that the figures are CPU time; the points are x y z, intensity and colour.
#![allow(clippy::unwrap_used, clippy::panic, missing_docs, reason = "test code")]

use criterion::{Criterion, Throughput};
use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
use std::fmt::Write as _;
use std::hint::black_box;
use std::io::Cursor;
use timberline_ingest::gather::gather;
use timberline_ingest::scatter::scatter;
use timberline_ingest::shard::ShardReader;
use timberline_ingest::{ScatterParams, TilesParams, UnitChoice, scan};
use timberline_pointcloud::TileGrid;

const POINTS: u32 = 1_000_000;

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    let mut group = criterion.benchmark_group("formats");
    group.throughput(Throughput::Elements(u64::from(POINTS)));
    let files = [
        ("text, x y z", text(false)),
        ("text, x y z i r g b", text(true)),
        ("PLY binary, float x y z", ply(false)),
        ("PLY binary, float x y z, intensity, colour", ply(true)),
        ("PCD binary, float x y z, intensity, colour", pcd()),
        ("E57, scaled integers, intensity, colour", e57_file()),
    ];
    for (name, bytes) in &files {
        group.bench_function(*name, |b| b.iter(|| read(bytes)));
    }
    let grid = TileGrid::new(4, [0, 0]).unwrap();
    let ply = &files[3].1;
    group.bench_function("scatter PLY into tiles of 4 m", |b| b.iter(|| scattered(ply, grid)));
    let shards = scattered(ply, grid);
    for (name, thin_m, outlier_factor) in [
        ("gather", 0.0, 0.0),
        ("gather, thin to 2 cm", 0.02, 0.0),
        ("gather, thin, mark", 0.02, 3.0),
    ] {
        let params = TilesParams { thin_m, outlier_factor, ..TilesParams::default() };
        group.bench_function(name, |b| b.iter(|| gathered(&shards, grid, &params)));
    }
    group.finish();
    criterion.final_summary();
}

/// Points on a wavy surface of 8 x 8 m, in scan lines.
fn point(i: u32) -> [f64; 3] {
    let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65_536.0;
    let (line, along) = (f64::from(i / 1000), f64::from(i % 1000));
    [along * 0.008, line * 0.008, 0.4 * noise * noise * noise]
}

fn text(with_colour: bool) -> Vec<u8> {
    let mut text = String::new();
    for i in 0..POINTS {
        let [x, y, z] = point(i);
        write!(text, "{x:.4} {y:.4} {z:.4}").unwrap();
        if with_colour {
            write!(text, " {} {} {} {}", i % 4000, i % 256, i % 255, i % 254).unwrap();
        }
        text.push('\n');
    }
    text.into_bytes()
}

fn body(with_colour: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    for i in 0..POINTS {
        point(i).iter().for_each(|value| bytes.extend((*value as f32).to_le_bytes()));
        if with_colour {
            bytes.extend((i as u16).to_le_bytes());
            bytes.extend([i as u8, (i >> 8) as u8, (i >> 16) as u8]);
        }
    }
    bytes
}

fn ply(with_colour: bool) -> Vec<u8> {
    let colour = if with_colour {
        "property ushort intensity\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    } else {
        ""
    };
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {POINTS}\nproperty float x\nproperty float y\n\
         property float z\n{colour}end_header\n"
    );
    [header.into_bytes(), body(with_colour)].concat()
}

fn pcd() -> Vec<u8> {
    let header = format!(
        "VERSION 0.7\nFIELDS x y z intensity r g b\nSIZE 4 4 4 2 1 1 1\nTYPE F F F U U U U\nCOUNT 1 1 1 1 1 1 1\n\
         WIDTH {POINTS}\nHEIGHT 1\nPOINTS {POINTS}\nDATA binary\n"
    );
    [header.into_bytes(), body(true)].concat()
}

fn e57_file() -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    let mut writer = E57Writer::new(&mut out, "file").unwrap();
    let scaled =
        || RecordDataType::ScaledInteger { min: 0, max: 1 << 20, scale: 1e-4, offset: 0.0 };
    let kinds = [
        (RecordName::CartesianX, scaled()),
        (RecordName::CartesianY, scaled()),
        (RecordName::CartesianZ, scaled()),
        (RecordName::Intensity, RecordDataType::UNIT_F32),
        (RecordName::ColorRed, RecordDataType::U8),
        (RecordName::ColorGreen, RecordDataType::U8),
        (RecordName::ColorBlue, RecordDataType::U8),
    ];
    let prototype = kinds.map(|(name, data_type)| Record { name, data_type }).to_vec();
    let mut scan = writer.add_pointcloud("one", prototype).unwrap();
    for i in 0..POINTS {
        let [x, y, z] = point(i).map(|value| RecordValue::ScaledInteger((value * 1e4) as i64));
        let colour = || RecordValue::Integer(i64::from(i % 256));
        let values = vec![x, y, z, RecordValue::Single(0.5), colour(), colour(), colour()];
        scan.add_point(values).unwrap();
    }
    scan.finalize().unwrap();
    writer.finalize().unwrap();
    drop(writer);
    out.into_inner()
}

fn read(bytes: &[u8]) {
    let source = Box::new(Cursor::new(bytes.to_vec()));
    let mut file = scan::from_source(source, UnitChoice::default(), None).unwrap();
    let mut points = 0;
    while let Some(cloud) = file.next_batch().unwrap() {
        points += black_box(cloud).len();
    }
    assert_eq!(points, POINTS as usize);
}

fn scattered(bytes: &[u8], grid: TileGrid) -> Vec<u8> {
    let source = Box::new(Cursor::new(bytes.to_vec()));
    let file = scan::from_source(source, UnitChoice::default(), None).unwrap();
    scatter(file, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap().0
}

fn gathered(shards: &[u8], grid: TileGrid, params: &TilesParams) {
    for tile in ShardReader::new(shards).unwrap().index().tiles() {
        let mut readers = [ShardReader::new(shards).unwrap()];
        black_box(gather(tile, grid, &mut readers, params).unwrap());
    }
}
