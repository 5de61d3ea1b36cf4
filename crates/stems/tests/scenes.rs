//! Small scenes with known stems, and what is no tree at all, over the whole stage.

#![allow(clippy::unwrap_used, missing_docs, reason = "these are tests")]

use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{BaseSource, GroundPoints, Heights, Labels, Stems, TreeCloud};
use timberline_artefact::stage::{Campaign, StageError};
use timberline_artefact::{Facts, UnitId, read};
use timberline_pointcloud::frame::quantise;
use timberline_pointcloud::{Frame, Point, PointCloud, TileGrid};
use timberline_stems::stage::{StemsStage, TreeCloudStage};
use timberline_stems::{StemsParams, TreeCloudParams};

/// Ground elevation of the scenes: a slope, m.
fn ground_m(x: f64) -> f64 {
    2.0 + 0.1 * x
}

/// The `k`th of evenly spread values in the unit square (Kronecker).
fn spread(k: u32) -> [f64; 2] {
    [0.754_877_666_25, 0.569_840_290_998].map(|step| (f64::from(k) * step).fract())
}

/// Points of a tapering stem: a share of its circumference, up to a height.
fn stem(at: [f64; 2], radius_m: f64, turn: f64, top_m: f64, count: u32) -> Vec<[f64; 3]> {
    let point = |k: u32| {
        let [u, v] = spread(k);
        let (sin, cos) = libm::sincos(u * turn * std::f64::consts::TAU);
        let r = radius_m * (1.0 - 0.6 * v) + 0.003 * (f64::from(k % 5) / 2.0 - 1.0);
        [at[0] + r * cos, at[1] + r * sin, ground_m(at[0]) + v * top_m]
    };
    (0..count).map(point).collect()
}

fn ground(edge_m: f64, count: u32) -> Vec<[f64; 3]> {
    let point = |k: u32| {
        let [x, y] = spread(k).map(|part| part * edge_m);
        [x, y, ground_m(x)]
    };
    (0..count).map(point).collect()
}

/// Three stems on a slope, the second seen over a third of its circumference only.
fn plot() -> Vec<[f64; 3]> {
    let mut points = ground(12.0, 6000);
    points.extend(stem([3.0, 3.0], 0.15, 1.0, 12.0, 6000));
    points.extend(stem([8.0, 4.0], 0.10, 0.34, 9.0, 3000));
    points.extend(stem([6.0, 9.0], 0.22, 1.0, 15.0, 8000));
    points
}

struct Scene {
    store: Alone,
    _folder: tempfile::TempDir,
}

impl Scene {
    /// Runs the stage `stems` over points in world coordinates cut into tiles.
    fn run(points: &[[f64; 3]], shift: [f64; 3], edge_m: u32) -> Result<(Self, Stems), StageError> {
        let folder = tempfile::tempdir()?;
        let mut cloud = PointCloud::new(Frame::near(shift));
        for p in points {
            let world = std::array::from_fn(|axis| quantise(p[axis] + shift[axis]));
            cloud.push_world(world, &Point::default());
        }
        let mut store = Alone::new(folder.path(), Campaign::default());
        let tiles = store.put_tiles(&cloud, TileGrid { edge_m, origin_m: [0, 0] })?;
        for (tile, part, facts) in &tiles {
            let height = |i: usize| {
                let [x, _, z] = part.world(i);
                (z - shift[2] - ground_m(x - shift[0])) as f32
            };
            let height_m: Vec<f32> = (0..part.len()).map(height).collect();
            let low = |i: &u32| height_m[*i as usize].abs() < 0.01;
            let ground = (0..part.len() as u32).filter(low).collect();
            let unit = UnitId::Tile(*tile);
            store.put(unit.clone(), &GroundPoints { ground, supplied: 0 }, facts.clone())?;
            store.put(unit, &Heights { height_m }, facts.clone())?;
        }
        let path = store.run::<StemsStage>(UnitId::Campaign, None, &StemsParams::default())?;
        let (_, stems) = read::<Stems>(&path)?;
        Ok((Self { store, _folder: folder }, stems))
    }
}

fn failure(points: &[[f64; 3]]) -> String {
    match Scene::run(points, [0.0; 3], 32) {
        Ok((_, stems)) => format!("{} trees", stems.stems.len()),
        Err(error) => error.to_string(),
    }
}

#[test]
fn stems_are_found_with_their_diameters_and_bases() {
    let (_, Stems { stems, .. }) = Scene::run(&plot(), [0.0; 3], 32).unwrap();
    let expected = [([3.0, 3.0], 0.15, 12.0), ([6.0, 9.0], 0.22, 15.0), ([8.0, 4.0], 0.10, 9.0)];
    assert_eq!(stems.len(), 3);
    for (stem, (at, radius_m, top_m)) in stems.iter().zip(expected) {
        let [x, y, z] = stem.base_m;
        assert!((x - at[0]).abs() < 0.03 && (y - at[1]).abs() < 0.03, "{stem:?}");
        assert!((z - ground_m(at[0])).abs() < 0.05, "{stem:?}");
        let dbh_m = 2.0 * radius_m * (1.0 - 0.6 * 1.3 / top_m);
        assert!((stem.dbh_m - dbh_m).abs() < 0.02, "{stem:?}, not {dbh_m}");
        assert_eq!(stem.base_source, BaseSource::Ground);
        assert!((stem.bounds.max[2] - z - top_m).abs() < 0.2, "{stem:?}");
    }
}

#[test]
fn tiles_and_the_order_of_points_do_not_matter() {
    let (_, whole) = Scene::run(&plot(), [0.0; 3], 32).unwrap();
    let mut points = plot();
    points.reverse();
    for edge_m in [4, 7] {
        assert_eq!(Scene::run(&points, [0.0; 3], edge_m).unwrap().1, whole);
    }
}

#[test]
fn a_shift_of_the_world_shifts_the_trees() {
    let shift = [500_000.0, 5_000_000.0, 1000.0];
    let (_, here) = Scene::run(&plot(), [0.0; 3], 32).unwrap();
    let (_, there) = Scene::run(&plot(), shift, 32).unwrap();
    assert_eq!((there.stems.len(), there.runs.len()), (here.stems.len(), here.runs.len()));
    for (a, b) in here.stems.iter().zip(&there.stems) {
        for axis in 0..3 {
            assert!((b.base_m[axis] - shift[axis] - a.base_m[axis]).abs() < 1e-3, "{a:?} {b:?}");
        }
        assert!((a.dbh_m - b.dbh_m).abs() < 1e-3);
    }
}

#[test]
fn a_tree_without_ground_stands_on_its_lowest_points() {
    let points = stem([3.0, 3.0], 0.15, 1.0, 12.0, 8000);
    let (_, Stems { stems, .. }) = Scene::run(&points, [0.0; 3], 32).unwrap();
    let [tree] = stems[..] else { panic!("{stems:?}") };
    assert_eq!(tree.base_source, BaseSource::LowestPoints);
    assert!((tree.base_m[2] - ground_m(3.0)).abs() < 0.1, "{tree:?}");
}

#[test]
fn a_sapling_is_undergrowth() {
    let mut points = plot();
    points.extend(stem([10.0, 10.0], 0.03, 1.0, 2.5, 3000));
    let (_, Stems { stems, .. }) = Scene::run(&points, [0.0; 3], 32).unwrap();
    assert_eq!(stems.len(), 3);
}

#[test]
fn two_trees_in_one_cloud_without_ground_are_two() {
    let mut points = stem([3.0, 3.0], 0.15, 1.0, 12.0, 6000);
    points.extend(stem([5.0, 3.0], 0.12, 1.0, 10.0, 6000));
    assert_eq!(failure(&points), "2 trees");
}

#[test]
fn a_tree_without_a_lower_stem_is_one_tree() {
    let points: Vec<[f64; 3]> =
        stem([3.0, 3.0], 0.5, 1.0, 12.0, 500).into_iter().filter(|p| p[2] > 9.0).collect();
    assert_eq!(failure(&points), "1 trees");
}

#[test]
fn what_is_no_tree_says_so() {
    let wall: Vec<[f64; 3]> = (0..5000)
        .map(|k| {
            let [u, v] = spread(k);
            [1.0 + 8.0 * u, 2.0, 1.0 + 6.0 * v]
        })
        .collect();
    let line: Vec<[f64; 3]> = (0..500).map(|k| [1.0, 1.0, 0.05 * f64::from(k)]).collect();
    let same = vec![[1.0, 2.0, 3.0]; 1000];
    let ten: Vec<[f64; 3]> = (0..10).map(|k| [f64::from(k), f64::from(k * k), 1.0]).collect();
    for (points, words) in [
        (&wall, "of a plane: this is no tree"),
        (&line, "of a plane: this is no tree"),
        (&same, "1 voxels with points: a tree takes at least 20"),
        (&ten, "10 voxels with points: a tree takes at least 20"),
        (&Vec::new(), "0 voxels with points: a tree takes at least 20"),
        (&ground(12.0, 6000), "of a plane: this is no tree"),
    ] {
        let text = failure(points);
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn a_wall_on_the_ground_is_no_stem() {
    let mut points = ground(12.0, 6000);
    points.extend((0..8000).map(|k| {
        let [u, v] = spread(k);
        [2.0 + 8.0 * u, 6.0, ground_m(2.0 + 8.0 * u) + 5.0 * v]
    }));
    assert!(failure(&points).contains("no stem found"), "{}", failure(&points));
}

#[test]
fn the_points_of_a_tree_are_those_with_its_label() {
    let (mut scene, Stems { stems, .. }) = Scene::run(&plot(), [0.0; 3], 8).unwrap();
    let tree = stems[0];
    // Every second point, by hand.
    let tiles: Vec<_> = scene.store.files.iter().filter(|f| f.kind == "points").cloned().collect();
    let mut labelled = 0;
    for file in &tiles {
        let (header, points) = read::<timberline_artefact::kinds::PointTile>(&file.path).unwrap();
        let label = |i: usize| if i.is_multiple_of(2) { tree.tree_id } else { 0 };
        let tree_id: Vec<u64> = (0..points.cloud.len()).map(label).collect();
        labelled += tree_id.iter().filter(|id| **id != 0).count();
        let labels = Labels { score: vec![0.5; tree_id.len()], tree_id };
        let facts = Facts::located_like(&header.facts);
        scene.store.put(file.unit.clone(), &labels, facts).unwrap();
    }
    let unit = UnitId::Tree(tree.tree_id);
    let params = TreeCloudParams::default();
    let path = scene.store.run::<TreeCloudStage>(unit, None, &params).unwrap();
    let (header, cloud) = read::<TreeCloud>(&path).unwrap();
    assert_eq!((cloud.cloud.len(), cloud.stem), (labelled, tree));
    assert_eq!(header.facts.frame, Some(Frame::near(tree.base_m)));
    assert_eq!(cloud.cloud.extra[TreeCloud::WOOD].len(), labelled);
}
