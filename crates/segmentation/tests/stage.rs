//! The stage on a row of crowns across tiles: the same labels however the row is cut.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

use std::collections::BTreeMap;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::*;
use timberline_artefact::stage::{Campaign, Stage};
use timberline_artefact::{Kind, UnitId, read, tree_id};
use timberline_pointcloud::frame::{quantise, ticks_from_world};
use timberline_pointcloud::{Point, PointCloud, TileGrid};
use timberline_segmentation::stage::SegmentationStage;
use timberline_segmentation::{SegmentMethod, SegmentationParams};

const CORNER: [f64; 3] = [500_000.0, 4_200_000.0, 80.0];

/// Echoes on a lattice of 0.7 m in the plane and 1.3 m in height.
fn points() -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    for i in 0..90 {
        for j in 0..30 {
            for k in 0..12 {
                let local = [0.7 * f64::from(i), 0.7 * f64::from(j), 1.3 * f64::from(k)];
                points.push([0, 1, 2].map(|axis| quantise(CORNER[axis] + local[axis])));
            }
        }
    }
    points
}

/// Crowns of several sizes and shapes in a row that crosses tiles; every fifth is rejected, every
/// seventh stands deep below the others' echoes.
fn models() -> Vec<CrownModel> {
    let model = |i: u32| {
        let top_m = if i % 7 == 6 { 6.5 } else { 13.0 + f64::from(i % 4) };
        let apex = [4.3 * f64::from(i) + 2.1, 9.0 + f64::from(i % 3), top_m];
        let apex_m = [0, 1, 2].map(|axis| quantise(CORNER[axis] + apex[axis]));
        let (shape, parameters) = match i % 4 {
            0 => (CrownShape::Mixed, [0.8, 0.3]),
            1 => (CrownShape::Cone, [0.25, 0.0]),
            2 => (CrownShape::Paraboloid, [-0.5, 0.0]),
            _ => (CrownShape::Blend, [0.3, 0.0]),
        };
        CrownModel {
            id: tree_id(apex_m[0], apex_m[1]),
            apex_m,
            height_m: apex[2],
            shape,
            parameters,
            radius_m: 2.5 + 0.5 * f64::from(i % 5),
            tolerance_m: 0.6,
            status: if i % 5 == 4 { CrownStatus::TooManyOutliers } else { CrownStatus::Accepted },
            ..CrownModel::default()
        }
    };
    (0..14).map(model).collect()
}

fn detected(model: CrownModel) -> Detection {
    Detection { model, score: 1.0, origin: Origin::Surface }
}

/// Tree and score of every point by its position, over all tiles.
fn run(grid: TileGrid) -> BTreeMap<[i64; 3], (u64, u32)> {
    run_with(grid, &SegmentationParams::default())
}

fn run_with(grid: TileGrid, params: &SegmentationParams) -> BTreeMap<[i64; 3], (u64, u32)> {
    run_on(&points().into_iter().map(|point| (point, 0)).collect::<Vec<_>>(), grid, params)
}

/// The same with points and classes given.
fn run_on(
    points: &[([f64; 3], u8)],
    grid: TileGrid,
    params: &SegmentationParams,
) -> BTreeMap<[i64; 3], (u64, u32)> {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign { grid: Some(grid), ..Campaign::default() });
    let models = models();
    let mut whole = PointCloud::default();
    for (world, classification) in points {
        whole.push_world(*world, &Point { classification: *classification, ..Point::default() });
    }
    let tiles = store.put_tiles(&whole, grid).unwrap();
    for (tile, cloud, facts) in &tiles {
        let height_m = (0..cloud.len()).map(|i| (cloud.world(i)[2] - CORNER[2]) as f32).collect();
        let here = |m: &&CrownModel| grid.tile_at(m.apex_m[0], m.apex_m[1]) == *tile;
        let mut trees: Vec<Detection> = models.iter().filter(here).cloned().map(detected).collect();
        trees.sort_by_key(|tree| tree.model.id);
        let unit = UnitId::Tile(*tile);
        store.put(unit.clone(), &Heights { height_m }, facts.clone()).unwrap();
        store.put(unit, &Detections { trees }, facts.clone()).unwrap();
    }
    let mut labelled = BTreeMap::new();
    for (tile, cloud, _) in tiles {
        let path = store.run::<SegmentationStage>(UnitId::Tile(tile), None, params).unwrap();
        let (_, Labels { tree_id, score }) = read::<Labels>(&path).unwrap();
        assert_eq!((tree_id.len(), score.len()), (cloud.len(), cloud.len()));
        for i in 0..cloud.len() {
            labelled.insert(cloud.world(i).map(ticks_from_world), (tree_id[i], score[i].to_bits()));
        }
    }
    labelled
}

#[test]
fn labels_do_not_depend_on_the_tiles() {
    for method in SegmentMethod::ALL {
        // Small blocks and reaches, so that there are several in the row.
        let params = SegmentationParams {
            method,
            block_m: 24,
            reach_m: 6.0,
            raster_radius_m: 4.0,
            ..SegmentationParams::default()
        };
        let whole = run_with(TileGrid::new(128, [0, 0]).unwrap(), &params);
        assert_eq!(whole.len(), 90 * 30 * 12);
        let labelled = whole.values().filter(|(tree, _)| *tree != 0).count();
        assert!(labelled > 2000, "{method:?}: {labelled}");
        for model in models().iter().skip(6).step_by(7) {
            let points = whole.values().filter(|(tree, _)| *tree == model.id).count();
            assert!(points > 10, "{method:?}: {points} points of a tree below the canopy");
        }
        for (edge, origin) in [(16, [0, 0]), (32, [5, 9]), (64, [32, 0])] {
            let tiled = run_with(TileGrid::new(edge, origin).unwrap(), &params);
            assert!(tiled == whole, "{method:?}: tiles of {edge} m");
        }
    }
}

/// As the stage `tiles` leaves it there when told not to drop it.
#[test]
fn noise_has_no_tree_and_is_no_canopy() {
    let grid = TileGrid::new(64, [0, 0]).unwrap();
    let clean: Vec<_> = points().into_iter().map(|point| (point, 0)).collect();
    let mut noisy = clean.clone();
    for (place, ([x, y, z], _)) in clean.iter().enumerate().step_by(37) {
        noisy.push(([*x, *y, quantise(z + 17.0)], [7, 18][place % 2]));
    }
    for method in SegmentMethod::ALL {
        let params = SegmentationParams { method, ..SegmentationParams::default() };
        let (expected, found) = (run_on(&clean, grid, &params), run_on(&noisy, grid, &params));
        assert_eq!(found.len(), noisy.len());
        for (position, label) in found {
            let other = expected.get(&position).copied().unwrap_or_default();
            assert_eq!(label, other, "{method:?} at {position:?}");
        }
    }
}

#[test]
fn labels_do_not_depend_on_threads() {
    for method in SegmentMethod::ALL {
        let params = SegmentationParams { method, block_m: 16, reach_m: 6.0, ..Default::default() };
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| run_with(TileGrid::new(128, [0, 0]).unwrap(), &params))
        };
        assert!(with(1) == with(3), "{method:?}");
    }
}

#[test]
fn accepted_crowns_have_points_and_rejected_none() {
    let labelled = run(TileGrid::new(64, [0, 0]).unwrap());
    let count = |id: u64| labelled.values().filter(|(tree, _)| *tree == id).count();
    for model in models() {
        let stands = model.status == CrownStatus::Accepted;
        assert_eq!(count(model.id) > 20, stands, "{model:?}");
    }
    assert!(count(0) > 1000);
    assert!(labelled.iter().all(|(p, (tree, _))| *tree == 0 || p[2] > ticks_from_world(81.0)));
}

#[test]
fn names_and_kinds() {
    assert_eq!(SegmentationStage::info().outputs, [Labels::NAME]);
    assert_eq!(SegmentationStage::halo_m(&SegmentationParams::default()), 15.0);
}
