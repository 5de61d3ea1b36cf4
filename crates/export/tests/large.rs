//! Memory and speed over campaigns of growing size: `cargo test --release -p timberline-export
//! --test large -- --ignored --nocapture`.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::time::Instant;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{
    GroundModel, GroundPoints, Heights, Labels, PointTile, Tree, Trees,
};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Crs, Facts, Raster, UnitId, tree_id};
use timberline_export::stage::{ExportStage, Params};
use timberline_pointcloud::{Bounds3, Frame, Point, PointCloud, TileGrid, TileId};

const EDGE_M: u32 = 128;
const POINTS: u32 = 250_000;

/// A tile of points on a slope with waves above it, and a tree every eight metres.
fn put_tile(alone: &mut Alone, grid: TileGrid, tile: TileId) {
    let [x0, y0] = grid.corner_m(tile);
    let mut cloud = PointCloud::new(Frame::new([x0, y0, 0]));
    for i in 0..POINTS {
        let (u, v) = (f64::from(i) * 0.754_877_666_2 % 1.0, f64::from(i) * 0.569_840_291 % 1.0);
        let height = if i % 3 == 0 { 0.0 } else { 10.0 + 8.0 * libm::sin(u * 40.0) };
        let edge = f64::from(EDGE_M) - 0.001;
        let local = [u * edge, v * edge, 100.0 + u * 5.0 + height];
        let local = local.map(timberline_pointcloud::frame::quantise);
        let point = Point { gps_time: 3e8 + f64::from(i) * 1e-5, ..Point::default() };
        cloud.push_local(local, &point);
    }
    let cloud = cloud.in_canonical_order();
    let rect = grid.rect(tile);
    let bounds =
        Bounds3 { min: [rect.min[0], rect.min[1], 100.0], max: [rect.max[0], rect.max[1], 140.0] };
    let facts = Facts {
        crs: Some(Crs { epsg: Some(32633), ..Crs::default() }),
        frame: Some(cloud.frame),
        bounds: Some(bounds),
        grid: Some(grid),
        ..Facts::default()
    }
    .count("points", cloud.len());
    let height_m: Vec<f32> =
        (0..cloud.len()).map(|i| (cloud.z[i] - 100.0 - cloud.x[i] * 0.04) as f32).collect();
    let ground = (0..POINTS).filter(|i| height_m[*i as usize] < 0.5).collect();
    let mut raster = Raster::covering(&rect, 0.5);
    raster.values.iter_mut().enumerate().for_each(|(i, z)| *z = 100.0 + i as f64 * 1e-5);
    let trees = (0..256_u32).map(|i| {
        let at = |place: u32| f64::from(place * 8 + 4);
        let [x, y] = [rect.min[0] + at(i % 16), rect.min[1] + at(i / 16)];
        let crown_m = (0..24).map(|c| [x + f64::from(c % 5), y + f64::from(c % 7)]).collect();
        Tree {
            id: tree_id(x, y),
            apex_m: [x, y, 118.0],
            height_m: 18.0,
            crown_m,
            ..Tree::default()
        }
    });
    let mut trees = Trees { trees: trees.collect() };
    trees.trees.sort_by_key(|tree| tree.id);
    let labels = Labels { tree_id: vec![0; cloud.len()], score: vec![0.0; cloud.len()] };
    let unit = || UnitId::Tile(tile);
    alone.put(unit(), &PointTile { cloud }, facts.clone()).unwrap();
    alone.put(unit(), &GroundPoints { ground, supplied: 0 }, facts.clone()).unwrap();
    alone.put(unit(), &GroundModel { raster, ..GroundModel::default() }, facts.clone()).unwrap();
    alone.put(unit(), &Heights { height_m }, facts.clone()).unwrap();
    alone.put(unit(), &labels, facts.clone()).unwrap();
    alone.put(unit(), &trees, facts).unwrap();
}

/// Peak resident memory since the last call, MB; Linux only.
fn peak_mb() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("0 0");
    let kilobytes: f64 = line.split_whitespace().nth(1).unwrap_or("0").parse().unwrap_or(0.0);
    // 5 resets the peak (proc_pid_clear_refs); where it cannot, peaks only grow.
    std::fs::write("/proc/self/clear_refs", "5").unwrap_or_default();
    kilobytes / 1024.0
}

#[test]
#[ignore = "a measurement of a minute"]
fn memory_does_not_grow_with_the_campaign() {
    let mut peaks = Vec::new();
    for tiles in [4, 16, 64] {
        let folder = tempfile::tempdir().unwrap();
        let grid = TileGrid::new(EDGE_M, [0, 0]).unwrap();
        let campaign = Campaign { name: "large".to_owned(), grid: Some(grid), crs: None };
        let mut alone = Alone::new(folder.path(), campaign);
        let side = f64::from(tiles).sqrt() as i32;
        for i in 0..tiles {
            let tile = TileId { ix: 4000 + i % side, iy: 40_000 + i / side };
            put_tile(&mut alone, grid, tile);
        }
        peak_mb();
        let start = Instant::now();
        alone.run::<ExportStage>(UnitId::Campaign, None, &Params::default()).unwrap();
        let (seconds, peak) = (start.elapsed().as_secs_f64(), peak_mb());
        let points = f64::from(tiles) * f64::from(POINTS) / 1e6;
        println!("{points:5.1} M points: {seconds:6.2} s, peak {peak:.0} MB");
        peaks.push(peak);
    }
    assert!(peaks[2] < peaks[1] * 1.2, "{peaks:?}");
}
