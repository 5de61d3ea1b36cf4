//! From files to tiles: what is in a tile depends neither on the tiles nor on the sequence of files.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use std::collections::BTreeMap;
use std::io::Cursor;
use timberline_ingest::gather::{Gathered, gather};
use timberline_ingest::scatter::{Scattered, scatter};
use timberline_ingest::shard::ShardReader;
use timberline_ingest::{LasFile, ScatterParams, TilesParams, UnitChoice, scan};
use timberline_pointcloud::frame::ticks_from_world;
use timberline_pointcloud::{TileGrid, TileId};

use las::point::{Classification, Format};
use las::{Builder, Point, Transform, Vector, Version, Writer};

fn file(points: &[Point], format: u8) -> Vec<u8> {
    let mut builder = Builder::from(Version::new(1, 4));
    builder.point_format = Format::new(format).unwrap();
    builder.point_format.is_compressed = true;
    let axis = || Transform { scale: 0.01, offset: 0.0 };
    builder.transforms = Vector { x: axis(), y: axis(), z: axis() };
    let mut writer = Writer::new(Cursor::new(Vec::new()), builder.into_header().unwrap()).unwrap();
    points.iter().for_each(|point| writer.write_point(point.clone()).unwrap());
    writer.into_inner().unwrap().into_inner()
}

/// A square metre grid of points over a stand of trees, from `x` on.
fn stand(x: i32, width: i32) -> Vec<Point> {
    let mut points = Vec::new();
    for i in 0..width * 2 {
        for j in 0..80 {
            let (px, py) = (f64::from(x) + f64::from(i) * 0.5, 500.0 + f64::from(j) * 0.5);
            let whole = (px * 2.0) as i32;
            let z = f64::from((whole * 7 + j * 13) % 40) * 0.5;
            points.push(Point {
                x: px,
                y: py,
                z: 300.0 + z,
                return_number: 1,
                number_of_returns: 1,
                classification: Classification::new(if z == 0.0 { 2 } else { 5 }).unwrap(),
                gps_time: Some(1000.0 + f64::from(whole) + f64::from(j) * 1e-3),
                ..Point::default()
            });
        }
    }
    points
}

fn scattered(bytes: &[u8], grid: TileGrid) -> (Vec<u8>, Scattered) {
    let source = Box::new(Cursor::new(bytes.to_vec()));
    let file = LasFile::from_source(source, UnitChoice::default(), None).unwrap();
    scatter(file, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap()
}

fn tiles(files: &[Vec<u8>], grid: TileGrid, params: &TilesParams) -> BTreeMap<TileId, Gathered> {
    let shards: Vec<(Vec<u8>, Scattered)> = files.iter().map(|f| scattered(f, grid)).collect();
    let mut ids: Vec<TileId> = shards.iter().flat_map(|shard| shard.1.index.tiles()).collect();
    ids.sort_unstable();
    ids.dedup();
    ids.into_iter()
        .map(|tile| {
            let mut readers: Vec<ShardReader<&[u8]>> = shards
                .iter()
                .map(|(bytes, _)| ShardReader::new(bytes.as_slice()).unwrap())
                .collect();
            (tile, gather(tile, grid, &mut readers, params).unwrap())
        })
        .collect()
}

/// All points of all tiles, sorted, with what tells them apart.
fn all_points(tiles: &BTreeMap<TileId, Gathered>) -> Vec<([i64; 3], u64, u8)> {
    let mut all: Vec<_> = tiles
        .values()
        .flat_map(|tile| {
            let cloud = &tile.cloud;
            (0..cloud.len()).map(move |i| {
                let at = cloud.world(i).map(ticks_from_world);
                (at, cloud.gps_time[i].to_bits(), cloud.classification[i])
            })
        })
        .collect();
    all.sort_unstable();
    all
}

fn grid(edge: u32, origin: i64) -> TileGrid {
    TileGrid::new(edge, [origin, -origin]).unwrap()
}

/// Two files that overlap by 10 m, with birds, noise and withheld points.
fn campaign() -> Vec<Vec<u8>> {
    let (mut a, mut b) = (stand(1000, 60), stand(1050, 60));
    let at = |x: f64, z: f64| Point {
        x,
        y: 520.0,
        z,
        return_number: 1,
        number_of_returns: 1,
        gps_time: Some(x),
        ..Point::default()
    };
    a.push(at(1020.0, 400.0));
    a.push(at(1063.9, 370.0));
    b.push(at(1064.1, 370.1));
    b.push(Point { classification: Classification::HighNoise, ..at(1080.0, 330.0) });
    b.push(Point { is_withheld: true, ..at(1081.0, 305.0) });
    vec![file(&a, 6), file(&b, 6)]
}

#[test]
fn tiles_and_the_sequence_of_files_do_not_matter() {
    let files = campaign();
    let params = TilesParams::default();
    let expected = all_points(&tiles(&files, grid(64, 0), &params));
    assert_eq!(expected.len(), 110 * 2 * 80);
    for (edge, origin) in [(16, 0), (32, 7), (1000, -3), (17, 5)] {
        let found = all_points(&tiles(&files, grid(edge, origin), &params));
        assert!(found == expected, "edge {edge} origin {origin}: {} points", found.len());
    }
    let reversed: Vec<Vec<u8>> = files.into_iter().rev().collect();
    let (a, b) = (tiles(&campaign(), grid(64, 0), &params), tiles(&reversed, grid(64, 0), &params));
    for (tile, gathered) in &a {
        // Missing GPS times are NaN; compare what is written, not by `==` of floats.
        assert_eq!(format!("{:?}", gathered.cloud), format!("{:?}", b[tile].cloud));
    }
}

#[test]
fn what_is_left_out_is_counted_by_its_rule() {
    let found = tiles(&campaign(), grid(1000, 0), &TilesParams::default());
    let sum = |count: fn(&Gathered) -> u64| found.values().map(count).sum::<u64>();
    assert_eq!(sum(|tile| tile.dropped.duplicate), 10 * 2 * 80);
    assert_eq!(sum(|tile| tile.dropped.isolated), 3);
    assert_eq!(sum(|tile| tile.dropped.noise), 1);
    assert_eq!(sum(|tile| tile.dropped.withheld), 1);
    assert_eq!(sum(|tile| tile.given), sum(|t| t.cloud.len() as u64 + t.dropped.total()));
    let off = TilesParams { isolated_points: 0, ..TilesParams::default() };
    let all = tiles(&campaign(), grid(1000, 0), &off);
    assert_eq!(all.values().map(|tile| tile.dropped.isolated).sum::<u64>(), 0);
}

#[test]
fn points_of_a_tile_are_in_canonical_order_and_in_its_square() {
    let grid = grid(64, 0);
    for (tile, gathered) in tiles(&campaign(), grid, &TilesParams::default()) {
        let cloud = &gathered.cloud;
        let [x, y] = grid.corner_m(tile);
        assert_eq!(cloud.frame.origin_m[..2], [x, y]);
        assert!(
            (0..cloud.len())
                .all(|i| grid.rect(tile).contains(cloud.world(i)[0], cloud.world(i)[1]))
        );
        assert_eq!(format!("{:?}", cloud), format!("{:?}", cloud.in_canonical_order()));
    }
}

#[test]
fn columns_of_one_file_are_zero_for_the_points_of_another() {
    let mut coloured = stand(1000, 20);
    coloured.iter_mut().for_each(|p| p.color = Some(las::Color::new(9, 8, 7)));
    let plain: Vec<Point> = stand(1010, 30);
    let files = [file(&coloured, 7), file(&plain, 6)];
    let found = tiles(&files, grid(1000, 0), &TilesParams::default());
    let cloud = &found.values().next().unwrap().cloud;
    let red: Vec<f64> = (0..cloud.len()).map(|i| cloud.extra["red"].value(i)).collect();
    // Of the two copies of an echo the one that knows its colour is kept.
    assert_eq!(red.iter().filter(|v| **v == 9.0).count(), 20 * 2 * 80);
    assert_eq!(red.iter().filter(|v| **v == 0.0).count(), 20 * 2 * 80);
    assert!(!cloud.extra.contains_key("scanner_channel") && !cloud.extra.contains_key("user_data"));
}

#[test]
fn a_damaged_shard_is_named() {
    let grid = grid(64, 0);
    let (mut bytes, scattered) = scattered(&campaign()[0], grid);
    let tile = scattered.index.tiles()[0];
    bytes[5] ^= 1;
    let mut readers = [ShardReader::new(bytes.as_slice()).unwrap()];
    let error = gather(tile, grid, &mut readers, &TilesParams::default()).unwrap_err().to_string();
    assert!(error.contains(&format!("tile {tile}")) && error.contains("checksum"), "{error}");
    let mut other = [ShardReader::new(bytes.as_slice()).unwrap()];
    let moved = TileGrid::new(64, [1, 0]).unwrap();
    let error = gather(tile, moved, &mut other, &TilesParams::default()).unwrap_err().to_string();
    assert!(error.contains("run the stage `scatter` again"), "{error}");
}

/// A terrestrial plot as text: a thinning wall of points over three tiles, with points in the air.
fn plot() -> Vec<u8> {
    let mut text = String::from("x y z intensity\n");
    for i in 0..30_000u32 {
        let noise =
            |salt: u32| f64::from((i ^ salt).wrapping_mul(2_654_435_761) >> 12) / 1_048_576.0;
        let x = 62.0 + 4.0 * noise(1) * noise(2);
        let y = if i % 600 == 0 { 499.0 + 3.0 * noise(5) } else { 500.0 + 0.002 * noise(3) };
        text.push_str(&format!("{x:.4} {y:.4} {:.4} {}\n", 2.0 * noise(4), i % 500));
    }
    text.into_bytes()
}

fn plot_tiles(grid: TileGrid, params: &TilesParams) -> BTreeMap<TileId, Gathered> {
    let source = Box::new(Cursor::new(plot()));
    let file = scan::from_source(source, UnitChoice::default(), None).unwrap();
    let (bytes, scattered) =
        scatter(file, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap();
    let gathered = |tile: TileId| {
        let mut readers = [ShardReader::new(bytes.as_slice()).unwrap()];
        (tile, gather(tile, grid, &mut readers, params).unwrap())
    };
    scattered.index.tiles().into_iter().map(gathered).collect()
}

/// Thinning and marking look beyond the tile, and find the same whatever it is.
#[test]
fn thinning_and_marks_do_not_depend_on_the_tiles() {
    let params = TilesParams {
        thin_m: 0.03,
        outlier_factor: 3.0,
        outlier_reach_m: 0.25,
        isolated_points: 2,
        ..TilesParams::default()
    };
    let whole = plot_tiles(grid(1000, 0), &params);
    let expected = all_points(&whole);
    let marked: u64 = whole.values().map(|tile| tile.marked).sum();
    let thinned: u64 = whole.values().map(|tile| tile.dropped.thinned).sum();
    assert!((10..60).contains(&marked), "{marked}");
    assert!(thinned > 15_000 && thinned + expected.len() as u64 == 30_000, "{thinned}");
    assert_eq!(expected.iter().filter(|point| point.2 == 7).count() as u64, marked);
    for (edge, origin) in [(1, 0), (2, 1), (4, 0), (64, 0)] {
        let tiles = plot_tiles(grid(edge, origin), &params);
        assert!(tiles.len() > 1);
        assert!(all_points(&tiles) == expected, "edge {edge} origin {origin}");
        assert_eq!(tiles.values().map(|tile| tile.marked).sum::<u64>(), marked);
    }
    let off = plot_tiles(grid(64, 0), &TilesParams::default());
    assert_eq!(all_points(&off).len(), 30_000);
    assert!(off.values().all(|tile| tile.marked == 0 && tile.dropped.thinned == 0));
}

/// A campaign may hold files of several formats.
#[test]
fn formats_mix() {
    let las = file(&stand(60, 5), 6);
    let text: String = stand(60, 5)
        .iter()
        .map(|p| format!("{},{},{},{}\n", p.x, p.y, p.z + 0.5, p.return_number))
        .collect();
    let grid = grid(1000, 0);
    let source = Box::new(Cursor::new(text.into_bytes()));
    let scan = scan::from_source(source, UnitChoice::default(), None).unwrap();
    let other = scatter(scan, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap().0;
    let (las, scattered) = scattered(&las, grid);
    let tile = scattered.index.tiles()[0];
    let mut readers = [las, other].map(|bytes| {
        let bytes: &'static [u8] = Box::leak(bytes.into_boxed_slice());
        ShardReader::new(bytes).unwrap()
    });
    let found = gather(tile, grid, &mut readers, &TilesParams::default()).unwrap();
    assert_eq!(found.cloud.len(), 2 * 5 * 2 * 80);
    assert_eq!(found.cloud.gps_time.iter().filter(|time| time.is_nan()).count(), 5 * 2 * 80);
}
