//! Real terrestrial scans and E57 and PCD files: what is known about them is found.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "test code")]

use std::path::{Path, PathBuf};
use timberline_ingest::gather::gather;
use timberline_ingest::scatter::scatter;
use timberline_ingest::shard::ShardReader;
use timberline_ingest::survey::{BLOCK_POINTS, survey, tile_edge_m};
use timberline_ingest::{Damaged, Error, Scan, ScatterParams, TilesParams, UnitChoice, scan};
use timberline_pointcloud::frame::ticks_from_world;
use timberline_pointcloud::{PointCloud, TileGrid};

fn data(name: &str) -> PathBuf {
    PathBuf::from(std::env::var("TIMBERLINE_DATA").unwrap()).join(name)
}

fn open(name: &str) -> Result<Box<dyn Scan>, Error> {
    scan::open(&data(name), UnitChoice::default(), None)
}

fn read(name: &str) -> (PointCloud, Box<dyn Scan>) {
    let mut file = open(name).unwrap();
    let mut cloud = PointCloud::default();
    while let Some(batch) = file.next_batch().unwrap() {
        cloud.append(&batch).unwrap();
    }
    cloud.validate().unwrap();
    (cloud, file)
}

/// Positions as ticks, sorted.
fn ticks(cloud: &PointCloud) -> Vec<[i64; 3]> {
    let mut all: Vec<[i64; 3]> =
        (0..cloud.len()).map(|index| cloud.world(index).map(ticks_from_world)).collect();
    all.sort_unstable();
    all
}

/// The largest difference between the sorted coordinates of two files, axis by axis, metres: a sequence
/// of whole points would change with the smallest rounding.
fn largest_difference_m(a: &[[i64; 3]], b: &[[i64; 3]]) -> f64 {
    let sorted = |points: &[[i64; 3]], axis: usize| {
        let mut values: Vec<i64> = points.iter().map(|point| point[axis]).collect();
        values.sort_unstable();
        values
    };
    let largest = |axis: usize| {
        let pairs = sorted(a, axis).into_iter().zip(sorted(b, axis));
        pairs.map(|(a, b)| (a - b).abs()).max().unwrap_or(0)
    };
    (0..3).map(largest).max().unwrap_or(0) as f64 * 1e-4
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn one_tree_as_las_ply_and_text_is_the_same() {
    let [las, ply, txt] = ["las", "ply", "txt"].map(|ending| {
        let (cloud, file) = read(&format!("tls/ITSMe/point_clouds/pc_tree.{ending}"));
        println!("{ending}: {} points, {} {:?}", cloud.len(), file.container(), file.notes());
        ticks(&cloud)
    });
    assert_eq!((las.len(), ply.len(), txt.len()), (30_826, 30_826, 30_826));
    // 32-bit floats of up to 112 m are multiples of 7.6 um.
    assert!(largest_difference_m(&ply, &txt) <= 1e-4, "{}", largest_difference_m(&ply, &txt));
    println!("las to txt: {} m", largest_difference_m(&las, &txt));
    // The LAS file has a scale of 1 mm.
    assert!(largest_difference_m(&las, &txt) <= 5.01e-4);
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn single_trees_are_read_and_have_tiles() {
    let check = |name: &str, points: u64, container: &str| {
        let facts = survey(&data(name), UnitChoice::default(), None).unwrap();
        let edge = tile_edge_m(std::slice::from_ref(&facts), BLOCK_POINTS);
        println!(
            "{name}: {} points, {:?}/m2, tiles of {edge} m, {:?}",
            facts.points, facts.density_per_m2, facts.notes
        );
        assert_eq!((facts.points, facts.container), (points, container), "{name}");
        let file = scan::open(&data(name), UnitChoice::default(), None).unwrap();
        let grid = TileGrid::new(edge, [0, 0]).unwrap();
        let (bytes, scattered) =
            scatter(file, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap();
        let mut kept = 0;
        for tile in scattered.index.tiles() {
            let mut readers = [ShardReader::new(bytes.as_slice()).unwrap()];
            let found = gather(tile, grid, &mut readers, &TilesParams::default()).unwrap();
            kept += found.cloud.len() as u64 + found.dropped.total();
        }
        assert_eq!(kept, points, "{name}");
    };
    let lines = |name: &str| {
        let text = std::fs::read_to_string(data(name)).unwrap();
        text.lines().filter(|line| !line.trim().is_empty()).count() as u64
    };
    for name in ["tree1", "tree13", "tree33", "Lille_11"] {
        let name = format!("tls/AdTree/{name}.xyz");
        check(&name, lines(&name), "text");
    }
    check("tls/ITSMe/point_clouds/dtm.txt", lines("tls/ITSMe/point_clouds/dtm.txt"), "text");
    check("tls/ITSMe/point_clouds/pc_tree_temp.ply", 12_180, "PLY");
    check("tls/TreeLS/pine.laz", 73_851, "LAZ");
}

/// What thinning and marking do to a scanned pine and a plot; the shares are printed for the docs.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn thinning_and_marking_of_scanned_trees() {
    let scans = [
        "TreeLS/pine.laz",
        "TreeLS/pine_plot.laz",
        "ITSMe/point_clouds/pc_tree.txt",
        "AdTree/tree13.xyz",
        "spanner/MLS_Clip.laz",
    ];
    for name in scans {
        for (thin_m, outlier_factor) in
            [(0.0, 2.0), (0.0, 3.0), (0.0, 5.0), (0.02, 3.0), (0.05, 3.0)]
        {
            let file = open(&format!("tls/{name}")).unwrap();
            let grid = TileGrid::new(32, [0, 0]).unwrap();
            let (bytes, scattered) =
                scatter(file, grid, &ScatterParams::default(), Vec::new(), |_| Ok(())).unwrap();
            let params = TilesParams { thin_m, outlier_factor, ..TilesParams::default() };
            let (mut kept, mut marked) = (0, 0);
            for tile in scattered.index.tiles() {
                let mut readers = [ShardReader::new(bytes.as_slice()).unwrap()];
                let found = gather(tile, grid, &mut readers, &params).unwrap();
                kept += found.cloud.len() as u64;
                marked += found.marked;
            }
            let share = 100.0 * marked as f64 / kept as f64;
            println!(
                "{name} thin {thin_m} factor {outlier_factor}: {kept} of {} kept, {share:.2} % marked",
                scattered.index.points
            );
            assert!(kept > 0 && share < 15.0, "{name}: {share}");
            assert!(thin_m > 0.0 || kept + 50_000 > scattered.index.points);
        }
    }
}

const E57: &str = "formats/e57/testdata";

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn bunnies_of_all_number_formats_are_one() {
    let bunny = |name: &str| ticks(&read(&format!("{E57}/{name}.e57")).0);
    let double = bunny("bunnyDouble");
    assert_eq!(double.len(), 30_571);
    for name in ["bunnyFloat", "bunnyInt19", "bunnyInt21", "bunnyInt24", "bunnyInt32"] {
        let other = bunny(name);
        let sums =
            |ticks: &[[i64; 3]]| [0, 1, 2].map(|axis| ticks.iter().map(|t| t[axis]).sum::<i64>());
        let (a, b) = (sums(&double), sums(&other));
        assert_eq!(other.len(), double.len(), "{name}");
        // On average nearer than a tick.
        assert!((0..3).all(|axis| (a[axis] - b[axis]).abs() <= 2 * 30_571), "{name}: {a:?} {b:?}");
    }
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn broken_and_odd_e57_files() {
    let refused = |name: &str| open(&format!("{E57}/{name}")).map(drop).unwrap_err().to_string();
    for name in ["empty.e57", "empty_pc.e57", "cartesian_invalid_state_single.e57"] {
        match open(&format!("{E57}/{name}")) {
            Ok(_) => {
                let (cloud, file) = read(&format!("{E57}/{name}"));
                println!("{name}: {} points, {:?} {:?}", cloud.len(), file.notes(), file.damage());
            }
            Err(_) => println!("{}", refused(name)),
        }
    }
    // The bad page holds the XML, without which nothing is known of the points.
    let message = refused("corrupt_crc.e57");
    assert!(message.contains("corrupt_crc.e57: E57 header"), "{message}");
    assert!(message.contains("invalid checksum") && message.contains("page 33"), "{message}");
    // Its packets once confused the `e57` crate; it is whole.
    let (cloud, file) = read(&format!("{E57}/read_error.e57"));
    assert_eq!((cloud.len(), file.damages().len()), (2651, 0));
    let (cloud, file) = read(&format!("{E57}/tiny_spherical.e57"));
    println!("tiny_spherical: {} points, {:?} {:?}", cloud.len(), cloud.bounds(), file.notes());
    assert!(!cloud.is_empty());
    let (cloud, _) = read(&format!("{E57}/tinyCartesianFloatRgb.e57"));
    assert!(cloud.extra.contains_key("red"));
}

/// PDAL's pair: a scan moved by its pose lies where the moved points lie.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn several_scans_and_poses() {
    let folder = "formats/PDAL/e57";
    let count = |name: &str| {
        let (cloud, file) = read(&format!("{folder}/{name}"));
        println!("{name}: {} points, {:?}, {:?}", cloud.len(), cloud.bounds(), file.notes());
        (cloud.len(), cloud.source_id.last().copied())
    };
    let a = count("A4.e57").0;
    let (both, last) = count("A_B.e57");
    assert!(both > a && last == Some(2));
    assert_eq!(count("A4_moved.e57").0, a);
    assert_eq!(count("A_moved_B.e57"), (both, last));
}

#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn pcd_as_text_and_binary_are_one() {
    let (text, a) = read("formats/lasR/pcd_ascii.pcd");
    let (binary, b) = read("formats/lasR/pcd_binary.pcd");
    println!("{:?} {:?}", a.notes(), b.notes());
    assert!(text.len() > 10_000 && text.len() == binary.len());
    // Text of four decimals, and 32-bit floats of up to 121 m.
    assert!(largest_difference_m(&ticks(&text), &ticks(&binary)) <= 2.01e-4);
    let names = |cloud: &PointCloud| cloud.extra.keys().cloned().collect::<Vec<String>>();
    assert_eq!(names(&text), names(&binary));
}

/// A damaged file is refused as a stage does it, and kept on request.
#[test]
#[ignore = "needs TIMBERLINE_DATA"]
fn damaged_files_follow_the_parameter() {
    let grid = TileGrid::new(64, [0, 0]).unwrap();
    let path = data(&format!("{E57}/corrupt_crc.e57"));
    let run = |path: &Path, damaged: Damaged| {
        let params = ScatterParams { damaged, ..ScatterParams::default() };
        let file = scan::open(path, UnitChoice::default(), None)?;
        scatter(file, grid, &params, Vec::new(), |_| Ok(())).map(|(_, scattered)| scattered)
    };
    assert!(run(&path, Damaged::Refuse).is_err());
    if let Ok(kept) = run(&path, Damaged::Keep) {
        assert!(kept.lost > 0);
        println!("{} kept, {} lost, {:?}", kept.index.points, kept.lost, kept.notes);
    }
}
