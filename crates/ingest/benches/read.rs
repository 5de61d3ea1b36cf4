//! Reading LAZ: pure decompression, decoded columns, and scattering into tiles.
//!
//! On one thread, so that the figures are CPU time. With TIMBERLINE_DATA set, on a real scan
//! (`als/lasR_bcts`), else on generated points.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    missing_docs,
    reason = "test code"
)]

use criterion::{Criterion, Throughput};
use std::hint::black_box;
use std::io::{Cursor, Seek, SeekFrom};
use std::path::Path;
use timberline_ingest::gather::gather;
use timberline_ingest::scatter::scatter;
use timberline_ingest::shard::ShardReader;
use timberline_ingest::{LasFile, ScatterParams, TilesParams, UnitChoice};
use timberline_pointcloud::TileGrid;

fn main() {
    let mut criterion = Criterion::default().configure_from_args().sample_size(10);
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().unwrap();
    run(&mut criterion, &scan());
    criterion.final_summary();
}

fn run(criterion: &mut Criterion, bytes: &[u8]) {
    let points = open(bytes).header().points;
    println!("{points} points, {} bytes", bytes.len());
    let mut group = criterion.benchmark_group("laz");
    group.throughput(Throughput::Elements(points));
    group.bench_function("decompress only (laz crate)", |b| b.iter(|| decompress(bytes)));
    group.bench_function("las crate, columns x y z", |b| b.iter(|| las_columns(bytes)));
    group.bench_function("all columns in metres", |b| b.iter(|| columns(bytes)));
    let grid = TileGrid::new(128, [0, 0]).unwrap();
    group.bench_function("scatter into tiles of 128 m", |b| b.iter(|| scattered(bytes, grid)));
    let shards = scattered(bytes, grid);
    println!("shards: {:.2} bytes a point", shards.len() as f64 / points as f64);
    group.bench_function("gather all tiles", |b| b.iter(|| gathered(&shards, grid)));
    group.finish();
}

/// The bytes of a LAZ file.
fn scan() -> Vec<u8> {
    if let Ok(data) = std::env::var("TIMBERLINE_DATA") {
        let folder = Path::new(&data).join("als/lasR_bcts");
        let mut files: Vec<_> =
            std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
        files.retain(|path| path.extension().is_some_and(|ending| ending == "laz"));
        files.sort();
        return std::fs::read(&files[0]).unwrap();
    }
    let mut builder = las::Builder::from((1, 4));
    builder.point_format = las::point::Format::new(6).unwrap();
    builder.point_format.is_compressed = true;
    let mut writer =
        las::Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    for i in 0..1_000_000u32 {
        let noise = f64::from(i.wrapping_mul(2_654_435_761) >> 16) / 65_536.0;
        let (line, along) = (f64::from(i / 1000), f64::from(i % 1000));
        let point = las::Point {
            x: along * 0.3 + noise,
            y: line * 0.3 - noise,
            z: 100.0 + 25.0 * noise,
            intensity: (noise * 900.0) as u16,
            return_number: 1 + (i % 3) as u8,
            number_of_returns: 3,
            gps_time: Some(2.6e8 + f64::from(i) * 3e-6),
            ..las::Point::default()
        };
        writer.write_point(point).unwrap();
    }
    writer.into_inner().unwrap().into_inner()
}

fn open(bytes: &[u8]) -> LasFile {
    let source = Box::new(Cursor::new(bytes.to_vec()));
    LasFile::from_source(source, UnitChoice::default(), None).unwrap()
}

fn decompress(bytes: &[u8]) {
    let header = las::Header::new(Cursor::new(bytes)).unwrap();
    let vlr = header.vlrs().iter().find(|vlr| vlr.record_id == 22204);
    let vlr = laz::LazVlr::from_buffer(&vlr.unwrap().data).unwrap();
    let mut source = Cursor::new(bytes.to_vec());
    let at = u32::from_le_bytes(bytes[96..100].try_into().unwrap());
    source.seek(SeekFrom::Start(u64::from(at))).unwrap();
    let len = vlr.items_size() as usize;
    let mut input = laz::LasZipDecompressor::new(source, vlr).unwrap();
    let mut record = vec![0; len * 1000];
    let mut left = header.number_of_points() as usize;
    while left > 0 {
        let count = left.min(1000);
        input.decompress_many(&mut record[..count * len]).unwrap();
        black_box(&record);
        left -= count;
    }
}

fn las_columns(bytes: &[u8]) {
    let options = las::ReaderOptions::default().with_laz_parallelism(las::LazParallelism::No);
    let mut reader = las::Reader::with_options(Cursor::new(bytes.to_vec()), options).unwrap();
    let data = reader.read_all().unwrap();
    black_box(data.x().sum::<f64>() + data.y().sum::<f64>() + data.z().sum::<f64>());
}

fn columns(bytes: &[u8]) {
    let mut file = open(bytes);
    while let Some(cloud) = file.next_batch().unwrap() {
        black_box(&cloud);
    }
}

fn scattered(bytes: &[u8], grid: TileGrid) -> Vec<u8> {
    scatter(open(bytes), grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap().0
}

fn gathered(shards: &[u8], grid: TileGrid) {
    let tiles = ShardReader::new(shards).unwrap().index().tiles();
    for tile in tiles {
        let mut readers = [ShardReader::new(shards).unwrap()];
        black_box(gather(tile, grid, &mut readers, &TilesParams::default()).unwrap());
    }
}
