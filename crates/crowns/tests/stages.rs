//! The stages on a simulated stand: complete, and the same however it is cut into tiles.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

mod common;

use common::{TrueCrown, scan};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::*;
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Kind, UnitId, read, read_header, tree_id};
use timberline_crowns::stage::{CrownFitStage, CrownModelStage, DetectionStage};
use timberline_crowns::{CrownFitParams, CrownModelParams, DetectionParams};
use timberline_pointcloud::{Point, PointCloud, TileGrid};

/// South-west corner of the stand in the world, m.
const CORNER: [f64; 2] = [500_000.0, 4_200_000.0];

struct Stand {
    crowns: Vec<TrueCrown>,
    points: Vec<[f64; 3]>,
}

/// Trees on a jittered 6 m grid in a square of 48 m, and a lone seedling of three echoes.
fn stand() -> Stand {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut crowns = Vec::new();
    for i in 0..8 {
        for j in 0..8 {
            let mut at =
                |k: i32| 6.0 * f64::from(k) + 3.0 - 24.0 + 2.0 * common::uniform(&mut random);
            let (x, y) = (at(i), at(j));
            crowns.push(TrueCrown::random(&mut random, x, y));
        }
    }
    let mut points = scan(&crowns, 24.0, 8.0, &mut random);
    points.retain(|p| (p[0] - 23.0).abs() > 1.5 || (p[1] - 23.0).abs() > 1.5);
    points.extend([[23.0, 23.0, 3.0], [23.3, 23.1, 2.0], [23.1, 23.4, 2.1]]);
    points.iter_mut().for_each(|p| {
        *p = [p[0] + 24.0 + CORNER[0], p[1] + 24.0 + CORNER[1], p[2] + 100.0]
            .map(timberline_pointcloud::frame::quantise);
    });
    Stand { crowns, points }
}

/// The highest echo near each true apex, and the seedling: world position and height.
fn tops(stand: &Stand) -> Vec<[f64; 3]> {
    let highest_near = |x: f64, y: f64, reach: f64| {
        stand
            .points
            .iter()
            .filter(|p| (p[0] - x).abs() < reach && (p[1] - y).abs() < reach)
            .copied()
            .max_by(|a, b| a[2].total_cmp(&b[2]))
            .unwrap()
    };
    let mut tops: Vec<[f64; 3]> = stand
        .crowns
        .iter()
        .map(|c| highest_near(c.apex[0] + 24.0 + CORNER[0], c.apex[1] + 24.0 + CORNER[1], 0.7))
        .collect();
    tops.push([CORNER[0] + 47.0, CORNER[1] + 47.0, 103.0]);
    tops
}

/// The nearest top within 3 m; surface points are those of the upper 60 %.
fn label_of(p: [f64; 3], tops: &[[f64; 3]]) -> (u64, f32) {
    let squared = |t: &[f64; 3]| (t[0] - p[0]) * (t[0] - p[0]) + (t[1] - p[1]) * (t[1] - p[1]);
    let nearest = tops.iter().min_by(|a, b| squared(a).total_cmp(&squared(b))).unwrap();
    let height = p[2] - 100.0;
    if squared(nearest) > 9.0 || height < 1.0 {
        return (0, 0.0);
    }
    let on_surface = height > 0.4 * (nearest[2] - 100.0);
    (tree_id(nearest[0], nearest[1]), if on_surface { 0.9 } else { 0.3 })
}

/// Rows of both tables, sorted by id, and the warnings.
type Results = (Vec<CrownModel>, Vec<Tree>, Vec<String>);

/// Runs both stages over all tiles.
fn run(grid: TileGrid, threads: usize) -> Results {
    run_with(grid, threads, &CrownFitParams::default())
}

fn run_with(grid: TileGrid, threads: usize, fit: &CrownFitParams) -> Results {
    let folder = tempfile::tempdir().unwrap();
    let campaign = Campaign { grid: Some(grid), ..Campaign::default() };
    let mut store = Alone::new(folder.path(), campaign);
    let stand = stand();
    let tops = tops(&stand);
    let mut whole = PointCloud::default();
    let first = Point { return_number: 1, number_of_returns: 1, ..Point::default() };
    stand.points.iter().for_each(|p| whole.push_world(*p, &first));
    let tiles = store.put_tiles(&whole, grid).unwrap();
    for (tile, cloud, facts) in &tiles {
        let here = |p: &&[f64; 3]| grid.tile_at(p[0], p[1]) == *tile;
        let world: Vec<[f64; 3]> = (0..cloud.len()).map(|i| cloud.world(i)).collect();
        let height_m = world.iter().map(|p| (p[2] - 100.0) as f32).collect();
        let (id, score) = world.iter().map(|p| label_of(*p, &tops)).unzip();
        let mut here: Vec<Treetop> = tops
            .iter()
            .filter(here)
            .map(|&apex_m| Treetop {
                id: tree_id(apex_m[0], apex_m[1]),
                apex_m,
                height_m: apex_m[2] - 100.0,
                ..Treetop::default()
            })
            .collect();
        here.sort_by_key(|top| top.id);
        let unit = UnitId::Tile(*tile);
        store.put(unit.clone(), &Heights { height_m }, facts.clone()).unwrap();
        store.put(unit.clone(), &Labels { tree_id: id, score }, facts.clone()).unwrap();
        store.put(unit, &Treetops { tops: here }, facts.clone()).unwrap();
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let (mut models, mut trees, mut warnings) = (Vec::new(), Vec::new(), Vec::new());
    let units: Vec<UnitId> = tiles.iter().map(|(tile, ..)| UnitId::Tile(*tile)).collect();
    for unit in &units {
        let params = CrownModelParams::default();
        let path =
            pool.install(|| store.run::<CrownModelStage>(unit.clone(), None, &params)).unwrap();
        models.extend(read::<CrownModels>(&path).unwrap().1.models);
        warnings.extend(read_header(&path).unwrap().warnings);
    }
    let all = DetectionParams { min_score: 0.0, ..DetectionParams::default() };
    for unit in &units {
        pool.install(|| store.run::<DetectionStage>(unit.clone(), None, &all)).unwrap();
    }
    for unit in units {
        let path = pool.install(|| store.run::<CrownFitStage>(unit, None, fit)).unwrap();
        trees.extend(read::<Trees>(&path).unwrap().1.trees);
    }
    models.sort_by_key(|model| model.id);
    trees.sort_by_key(|tree| tree.id);
    let warnings = warnings.into_iter().map(|w| format!("{}: {}", w.subject, w.message)).collect();
    (models, trees, warnings)
}

#[test]
fn every_treetop_has_a_row_and_most_a_crown() {
    let (models, trees, warnings) = run(TileGrid::new(64, [0, 0]).unwrap(), 1);
    assert_eq!((models.len(), trees.len()), (65, 65));
    let accepted = models.iter().filter(|m| m.status == CrownStatus::Accepted).count();
    assert!(accepted >= 60, "{accepted}");
    let seedling = tree_id(CORNER[0] + 47.0, CORNER[1] + 47.0);
    let row = trees.iter().find(|tree| tree.id == seedling).unwrap();
    assert_eq!(row.position_method, PositionMethod::HighestPoint);
    assert_eq!((row.height_m, row.ground_m), (3.0, 100.0));
    assert!(TreeFlag::names(row.flags).contains("model-rejected"), "{row:?}");
    assert!(warnings.iter().any(|w| w.contains(&seedling.to_string()) && w.contains("too few")));
}

#[test]
fn positions_are_nearer_to_the_stem_than_the_highest_points() {
    let stand = stand();
    let (_, trees, _) = run(TileGrid::new(64, [0, 0]).unwrap(), 1);
    let (mut fitted, mut highest, mut count) = (0.0, 0.0, 0.0);
    for crown in &stand.crowns {
        let at = [crown.apex[0] + 24.0 + CORNER[0], crown.apex[1] + 24.0 + CORNER[1]];
        let off = |p: [f64; 2]| libm::hypot(p[0] - at[0], p[1] - at[1]);
        let tree =
            trees.iter().min_by(|a, b| off(a.position_m).total_cmp(&off(b.position_m))).unwrap();
        if tree.position_method == PositionMethod::L1 && tree.status == CrownStatus::Accepted {
            fitted += off(tree.position_m);
            highest += off([tree.apex_m[0], tree.apex_m[1]]);
            count += 1.0;
            assert!(tree.crown_area_m2 > 1.0 && tree.crown_m.len() > 2);
            assert!(tree.crown_base_m < tree.height_m);
        }
    }
    assert!(count > 50.0);
    assert!(fitted < highest, "{} m against {} m", fitted / count, highest / count);
}

#[test]
fn tiles_and_threads_do_not_matter() {
    let debug = |result: &Results| {
        let mut warnings = result.2.clone();
        warnings.sort();
        // Not-a-number fields are equal as text.
        format!("{:?} {:?} {warnings:?}", result.0, result.1)
    };
    // Two axes in a narrow box: a search of its own in every tree.
    let searched =
        CrownFitParams { omega: 0.3, prior_half_width_m: 0.15, ..CrownFitParams::default() };
    for fit in [CrownFitParams::default(), searched] {
        let whole = debug(&run_with(TileGrid::new(64, [0, 0]).unwrap(), 1, &fit));
        for (grid, threads) in [((16, [0, 0]), 2), ((32, [7, 11]), 1), ((32, [16, 16]), 2)] {
            let cut = debug(&run_with(TileGrid::new(grid.0, grid.1).unwrap(), threads, &fit));
            assert!(cut == whole, "tiles of {} m from {:?}, omega {}", grid.0, grid.1, fit.omega);
        }
    }
}

#[test]
fn names_and_kinds() {
    use timberline_artefact::stage::Stage;
    assert_eq!(CrownModelStage::info().outputs, [CrownModels::NAME]);
    assert_eq!(CrownFitStage::info().outputs, [Trees::NAME]);
    assert_eq!(CrownModelStage::halo_m(&CrownModelParams::default()), 10.0);
    assert_eq!(CrownFitStage::halo_m(&CrownFitParams::default()), 18.0);
}
