//! What is known about the real scans is found by the reader: normalised or not, duplicates across
//! adjacent files, tile edges, and that nothing is lost on the way to the tiles.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use std::path::{Path, PathBuf};
use timberline_ingest::gather::gather;
use timberline_ingest::scatter::{Scattered, scatter};
use timberline_ingest::shard::ShardReader;
use timberline_ingest::survey::{BLOCK_POINTS, FileFacts, survey, tile_edge_m};
use timberline_ingest::{LasFile, ScatterParams, TilesParams, UnitChoice};
use timberline_pointcloud::{TileGrid, TileId};

fn data(pattern: &str) -> Vec<PathBuf> {
    let folder = PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap()).join(pattern);
    if folder.is_file() {
        return vec![folder];
    }
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    let is_las = |path: &PathBuf| path.extension().is_some_and(|e| e == "las" || e == "laz");
    files.retain(is_las);
    files.sort();
    files
}

fn run(path: &Path, grid: TileGrid) -> (Vec<u8>, Scattered) {
    let file = LasFile::open(path, UnitChoice::default(), None).unwrap();
    scatter(file, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap()
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn normalised_scans_are_recognised_and_others_are_not() {
    for folder in std::fs::read_dir(data_root().join("als")).unwrap() {
        let folder = folder.unwrap().path();
        let files = if folder.is_dir() { data(&folder.to_string_lossy()) } else { Vec::new() };
        for path in files {
            let (_, scattered) = run(&path, TileGrid::new(128, [0, 0]).unwrap());
            println!(
                "{} | normalised {} | ground {} of {} | return 0: {} | {:?}",
                path.strip_prefix(data_root()).unwrap().display(),
                scattered.is_normalised,
                scattered.ground,
                scattered.index.points,
                scattered.zero_returns,
                scattered.notes
            );
            let name = path.to_string_lossy();
            let normalised = ["SJER", "MixedConifer", "Megaplot", "pycrown", "rLiDAR"];
            let others = ["hj_andrews", "lasR_bcts", "MixedEucaNat", "Topography", "ALS_Clip"];
            if others.iter().any(|part| name.contains(part)) {
                assert!(!scattered.is_normalised, "{name}");
            }
            if normalised.iter().any(|part| name.contains(part)) {
                assert!(scattered.is_normalised, "{name}");
            }
        }
    }
}

fn data_root() -> PathBuf {
    PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap())
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn tiles_of_three_scans_hold_all_their_points() {
    let files = data("als/lasR_bcts");
    let facts: Vec<FileFacts> =
        files.iter().map(|path| survey(path, UnitChoice::default(), None).unwrap()).collect();
    let edge = tile_edge_m(&facts, BLOCK_POINTS);
    facts.iter().for_each(|f| {
        println!("{} points, {:?} per m2, {}", f.points, f.density_per_m2, f.crs.name);
    });
    println!("tile edge {edge} m");
    assert_eq!(edge, 128);
    let grid = TileGrid::new(edge, [0, 0]).unwrap();
    let shards: Vec<_> = files.iter().map(|path| run(path, grid)).collect();
    let mut tiles: Vec<TileId> = shards.iter().flat_map(|s| s.1.index.tiles()).collect();
    tiles.sort_unstable();
    tiles.dedup();
    let (mut kept, mut dropped) = (0, [0; 5]);
    for tile in tiles {
        let mut readers: Vec<_> =
            shards.iter().map(|s| ShardReader::new(s.0.as_slice()).unwrap()).collect();
        let found = gather(tile, grid, &mut readers, &TilesParams::default()).unwrap();
        kept += found.cloud.len() as u64;
        let d = found.dropped;
        let counts = [d.withheld, d.noise, d.overlap, d.isolated, d.duplicate];
        dropped.iter_mut().zip(counts).for_each(|(sum, count)| *sum += count);
    }
    println!("kept {kept}, withheld noise overlap isolated duplicate {dropped:?}");
    let given: u64 = facts.iter().map(|f| f.points).sum();
    assert_eq!(kept + dropped.iter().sum::<u64>(), given);
}

/// GPS times are decoded here and not by the `laz` crate, and with them the returns they depend on.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn what_is_decoded_is_what_the_laz_crate_decodes() {
    for name in [
        "als/lasR_bcts/bcts_1.laz",
        "formats/laspy/data/autzen_trim.laz",
        "als/spanner/UAS_Clip.laz",
        "formats/PDAL/laz/las_with_several_extra_byte_bloc.laz",
        "uas_treeclips/Plot_8_Tree_28.laz",
    ] {
        let path = data_root().join(name);
        let mut ours = Vec::new();
        let mut file = LasFile::open(&path, UnitChoice::default(), None).unwrap();
        while let Some(cloud) = file.next_batch().unwrap() {
            ours.extend((0..cloud.len()).map(|index| {
                let point = cloud.point(index);
                let returns = [point.return_number, point.number_of_returns];
                (point.gps_time.to_bits(), returns, point.intensity)
            }));
        }
        let mut reader = las::Reader::from_path(&path).unwrap();
        let theirs = reader.read_all().unwrap();
        let theirs = theirs.points().map(|point| {
            let point = point.unwrap();
            let returns = [point.return_number, point.number_of_returns];
            (point.gps_time.unwrap().to_bits(), returns, point.intensity)
        });
        let theirs: Vec<_> = theirs.collect();
        let times: std::collections::BTreeSet<u64> = theirs.iter().map(|point| point.0).collect();
        println!("{name}: {} points, {} times", theirs.len(), times.len());
        assert!(times.len() > 1000, "{name} has few times");
        assert!(ours == theirs, "{name}");
    }
}
