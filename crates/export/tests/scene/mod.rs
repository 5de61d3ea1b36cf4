//! A small campaign with known terrain and trees, as the artefacts of the stages before `export`.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{
    GroundModel, GroundPoints, Heights, Labels, PointTile, PositionMethod, Tree, Trees,
};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Crs, Facts, Raster, UnitId, tree_id};
use timberline_pointcloud::{Bounds3, Column, Frame, Point, PointCloud, TileGrid, TileId};

/// Corner of the first plot; the second is 20 km to the east.
const CORNER: [f64; 2] = [481_216.0, 3_813_056.0];
const PLOTS: [f64; 2] = [0.0, 20_480.0];
const EDGE_M: f64 = 100.0;

/// Elevation of the terrain.
pub(crate) fn ground_m(x: f64, y: f64) -> f64 {
    let (u, v) = (x - CORNER[0], y - CORNER[1]);
    300.0 + 0.15 * u % 60.0 + 4.0 * libm::sin(u / 25.0) * libm::cos(v / 30.0) + 0.05 * v
}

/// Centre and height of every tree.
fn stems() -> Vec<[f64; 3]> {
    let mut stems = Vec::new();
    for plot in PLOTS {
        for i in 0..49 {
            let (a, b) = (f64::from(i % 7), f64::from(i / 7));
            let x = CORNER[0] + plot + 8.0 + a * 14.0 + f64::from(i * 7 % 5) - 2.0;
            let y = CORNER[1] + 8.0 + b * 14.0 + f64::from(i * 11 % 5) - 2.0;
            stems.push([x, y, 12.0 + f64::from(i * 13 % 17)]);
        }
    }
    stems
}

const RADIUS_M: f64 = 4.0;

/// The tree over a position and the height of its crown there.
fn crown_at(stems: &[[f64; 3]], x: f64, y: f64) -> Option<(usize, f64)> {
    stems.iter().enumerate().find_map(|(number, [tx, ty, height])| {
        let r2 = (x - tx) * (x - tx) + (y - ty) * (y - ty);
        let depth = r2 / (RADIUS_M * RADIUS_M);
        (depth <= 1.0).then(|| (number, height * (1.0 - 0.6 * depth)))
    })
}

struct Scene {
    stems: Vec<[f64; 3]>,
    points: Vec<([f64; 3], f32, u64, Point)>,
    trees: Vec<Tree>,
}

fn tree(stem: &[f64; 3]) -> Tree {
    let [x, y, height] = *stem;
    let ground = ground_m(x, y);
    let corner = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / 16.0;
        [x + RADIUS_M * libm::cos(angle), y + RADIUS_M * libm::sin(angle)]
    };
    Tree {
        id: tree_id(x, y),
        apex_m: [x, y, ground + height],
        ground_m: ground,
        height_m: height,
        position_m: [x + 0.1, y],
        position_method: PositionMethod::L1,
        position_extent_m: 0.05,
        position_standard_error_m: 0.125,
        surface_centre_m: [x + 0.1, y],
        surface_apex_m: ground + height,
        semi_axes_m: [1.5, 1.25],
        rotation_deg: x % 180.0,
        fit_cells: 60,
        fit_objective_m: 9.0,
        fit_residual_m: 0.15,
        fit_gap: 2.5e-7,
        fit_nodes: 3,
        crown_radius_m: RADIUS_M,
        crown_area_m2: 49.0,
        crown_m: (0..16).map(corner).collect(),
        crown_base_m: f64::NAN,
        points: 100,
        ..Tree::default()
    }
}

fn scene(points_per_plot: u32) -> Scene {
    let stems = stems();
    let trees: Vec<Tree> = stems.iter().map(tree).collect();
    let mut points = Vec::new();
    for plot in PLOTS {
        for i in 0..points_per_plot {
            // R2 sequence: evenly spread, the same everywhere.
            let (u, v) = (f64::from(i) * 0.754_877_666_2 % 1.0, f64::from(i) * 0.569_840_291 % 1.0);
            let position = [CORNER[0] + plot + u * EDGE_M, CORNER[1] + v * EDGE_M, 0.0];
            let [x, y, _] = position.map(timberline_pointcloud::frame::quantise);
            let over = crown_at(&stems, x, y).filter(|_| i % 4 != 0);
            let height = over.map_or(0.0, |(_, height)| height);
            let z = timberline_pointcloud::frame::quantise(ground_m(x, y) + height);
            let point = Point {
                intensity: (i % 1000) as u16,
                return_number: if over.is_some() { 1 } else { 2 },
                number_of_returns: 2,
                classification: if i % 9 == 0 { 2 } else { 5 },
                gps_time: 3e8 + f64::from(i),
                ..Point::default()
            };
            let id = over.map_or(0, |(number, _)| trees[number].id);
            points.push(([x, y, z], height as f32, id, point));
        }
    }
    Scene { stems, points, trees }
}

fn crs() -> Crs {
    Crs { epsg: Some(32611), name: "WGS 84 / UTM zone 11N".to_owned(), ..Crs::default() }
}

/// The artefacts of one tile.
fn tile(scene: &Scene, grid: TileGrid, tile: TileId, alone: &mut Alone) {
    let unit = UnitId::Tile(tile);
    let [x, y] = grid.corner_m(tile);
    let mut cloud = PointCloud::new(Frame::new([x, y, 300]));
    let own: Vec<_> =
        scene.points.iter().filter(|(p, ..)| grid.tile_at(p[0], p[1]) == tile).collect();
    own.iter().for_each(|(world, .., point)| cloud.push_world(*world, point));
    let echo = own.iter().map(|(.., point)| point.intensity / 2).collect();
    cloud.extra.insert("echo".to_owned(), Column::U16(echo));
    let label = own.iter().map(|(.., point)| f32::from(point.intensity)).collect();
    cloud.extra.insert("treeID".to_owned(), Column::F32(label));
    let order = timberline_pointcloud::order::canonical_order(&cloud);
    let cloud = cloud.select(&order);
    let sorted: Vec<_> = order.iter().map(|i| own[*i as usize]).collect();
    let mut bounds = Bounds3::EMPTY;
    (0..cloud.len()).for_each(|i| bounds.include(cloud.world(i)));
    let facts = Facts {
        crs: Some(crs()),
        frame: Some(cloud.frame),
        bounds: Some(bounds),
        grid: Some(grid),
        ..Facts::default()
    }
    .count("points", cloud.len());
    let ground = (0..cloud.len() as u32).filter(|i| sorted[*i as usize].1 == 0.0).collect();
    let mut raster = Raster::covering(&grid.rect(tile), 1.0);
    for row in 0..raster.rows {
        for column in 0..raster.columns {
            let [x, y] = raster.centre(column, row);
            let index = raster.index(column, row);
            raster.values[index] = ground_m(x, y);
        }
    }
    let at = |t: &&Tree| grid.tile_at(t.apex_m[0], t.apex_m[1]) == tile;
    let mut trees: Vec<Tree> = scene.trees.iter().filter(at).cloned().collect();
    trees.sort_by_key(|tree| tree.id);
    let heights = Heights { height_m: sorted.iter().map(|(_, height, ..)| *height).collect() };
    let labels = Labels {
        tree_id: sorted.iter().map(|(.., id, _)| *id).collect(),
        score: vec![1.0; cloud.len()],
    };
    alone.put(unit.clone(), &PointTile { cloud }, facts.clone()).unwrap();
    alone.put(unit.clone(), &GroundPoints { ground, supplied: 0 }, facts.clone()).unwrap();
    let model = GroundModel { raster, patches: Vec::new() };
    alone.put(unit.clone(), &model, facts.clone()).unwrap();
    alone.put(unit.clone(), &heights, facts.clone()).unwrap();
    alone.put(unit.clone(), &labels, facts.clone()).unwrap();
    alone.put(unit, &Trees { trees }, facts).unwrap();
}

/// A campaign of two plots 20 km apart, or of the first alone, cut into tiles of a given edge.
pub(crate) fn campaign(
    folder: &std::path::Path,
    edge_m: u32,
    origin_m: [i64; 2],
    plots: usize,
) -> Alone {
    let mut scene = scene(30_000);
    let end = CORNER[0] + PLOTS[plots - 1] + EDGE_M;
    scene.points.retain(|(p, ..)| p[0] < end);
    scene.trees.retain(|tree| tree.apex_m[0] < end);
    let grid = TileGrid::new(edge_m, origin_m).unwrap();
    let mut tiles: Vec<TileId> =
        scene.points.iter().map(|(p, ..)| grid.tile_at(p[0], p[1])).collect();
    tiles.sort_unstable();
    tiles.dedup();
    let name = "two plots of test trees".to_owned();
    let campaign = Campaign { name, grid: Some(grid), crs: None };
    let mut alone = Alone::new(folder, campaign);
    tiles.into_iter().for_each(|id| tile(&scene, grid, id, &mut alone));
    assert_eq!(scene.stems.len(), 98);
    alone
}
