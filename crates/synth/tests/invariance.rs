//! The same points whatever the threads and the pieces, and the same as ever.

#![allow(clippy::unwrap_used, reason = "a scene that cannot be made fails the test")]

use timberline_pointcloud::frame::ticks_from_world;
use timberline_pointcloud::{PointCloud, Rect, TileGrid};
use timberline_synth::{Scene, benchmark, sample, tables};
use xxhash_rust::xxh3::Xxh3;

/// Hash of positions in ticks and of all attributes, in the order of the points.
fn hash(cloud: &PointCloud) -> u64 {
    let mut hash = Xxh3::new();
    for i in 0..cloud.len() {
        cloud.world(i).map(ticks_from_world).iter().for_each(|t| hash.update(&t.to_le_bytes()));
        let point = cloud.point(i);
        hash.update(&point.gps_time.to_le_bytes());
        hash.update(&point.scan_angle_deg.to_le_bytes());
        hash.update(&point.intensity.to_le_bytes());
        hash.update(&point.source_id.to_le_bytes());
        hash.update(&[
            point.return_number,
            point.number_of_returns,
            point.classification,
            point.flags,
        ]);
    }
    hash.digest()
}

fn small() -> Scene {
    Scene::new(benchmark::stand(60_000, 21)).unwrap()
}

#[test]
fn threads_do_not_matter() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let scene = small();
            let area = scene.params().area;
            (tables::truth_trees(&scene, &area), hash(&scene.points_in(&area)))
        })
    };
    assert_eq!(with(1), with(2));
}

#[test]
fn pieces_do_not_matter() {
    let scene = small();
    let whole = scene.points_in(&scene.params().area);
    for grid in [TileGrid::new(32, [0, 0]).unwrap(), TileGrid::new(21, [5, -3]).unwrap()] {
        let mut pieces = PointCloud::new(whole.frame);
        for (tile, cloud) in scene.blocks(grid) {
            let rect = grid.rect(tile);
            assert!((0..cloud.len()).all(|i| rect.contains(cloud.world(i)[0], cloud.world(i)[1])));
            pieces.append(&cloud).unwrap();
        }
        assert_eq!(hash(&pieces.in_canonical_order()), hash(&whole.in_canonical_order()));
    }
}

#[test]
fn a_rectangle_outside_the_area_is_empty() {
    let scene = small();
    let away = scene.params().area.moved([5000.0, 0.0]);
    assert!(scene.points_in(&away).is_empty());
    let upside_down = Rect { min: [1.0, 1.0], max: [0.0, 0.0] };
    assert!(scene.points_in(&upside_down).is_empty());
}

#[test]
fn a_bench_stand_has_the_points_asked_for() {
    let scene = Scene::new(benchmark::stand(200_000, 3)).unwrap();
    let points: usize =
        scene.blocks(TileGrid::new(64, [0, 0]).unwrap()).map(|(_, cloud)| cloud.len()).sum();
    assert!((points as f64 / 200_000.0 - 1.0).abs() < 0.15, "{points}");
}

/// Raise these numbers only with a change that is meant to change the sample.
#[test]
fn the_sample_is_what_it_was() {
    let stand = sample::als_stand().unwrap();
    let counts: Vec<usize> = stand.tiles.iter().map(|tile| tile.cloud.len()).collect();
    let hashes: Vec<u64> = stand.tiles.iter().map(|tile| hash(&tile.cloud)).collect();
    let text = |name: &str| &stand.tables.iter().find(|(path, _)| path == name).unwrap().1;
    let lines = |name: &str| text(name).lines().count();
    let tile = &stand.tiles[0].cloud;
    let mean_z = (0..tile.len()).map(|i| tile.world(i)[2]).sum::<f64>() / tile.len() as f64;
    assert_eq!(counts, COUNTS);
    assert!((mean_z - MEAN_Z_M).abs() < 1e-3, "{mean_z}");
    assert_eq!([lines("truth/trees.csv"), lines("field_trees.csv"), lines("plots.csv")], LINES);
    assert_eq!(format!("{:016x}", hashes[0]), HASH);
    let noise = stand.tiles.iter().flat_map(|tile| &tile.cloud.classification);
    assert!(
        noise.clone().any(|&class| class == 7) && noise.clone().all(|c| [1, 7, 18].contains(c))
    );
}

const COUNTS: [usize; 4] = [141_129, 142_901, 142_366, 137_168];
const MEAN_Z_M: f64 = 723.2730;
const LINES: [usize; 3] = [3_170, 204, 15];
const HASH: &str = "96815e0ae0f0ea49";
