//! The stages over tiles: the same ground, terrain and heights however the campaign is cut.

#![allow(clippy::unwrap_used, reason = "these are tests")]

mod forest;

use forest::{ORIGIN, cloud_of, forest};
use std::collections::BTreeMap;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{GroundModel, GroundPoints, Heights, PointTile};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Kind, UnitId};
use timberline_ground::stage::{DtmStage, GroundStage, surface_of};
use timberline_ground::{DtmParams, GroundParams};
use timberline_pointcloud::frame::ticks_from_world;
use timberline_pointcloud::{Frame, PointCloud, TileGrid, TileId};

/// What the stages say about every point and raster cell of the campaign.
#[derive(Debug, Default, PartialEq)]
struct Outcome {
    /// Bits of the height, and whether it is ground, by position.
    points: BTreeMap<[i64; 3], (u32, bool)>,
    /// Bits of the elevation by world cell that has one.
    cells: BTreeMap<[i64; 2], u64>,
}

fn tiles_of(store: &mut Alone, cloud: &PointCloud, grid: TileGrid) -> Vec<TileId> {
    store.put_tiles(cloud, grid).unwrap().into_iter().map(|(tile, ..)| tile).collect()
}

fn file<K: Kind>(store: &Alone, tile: TileId) -> K {
    store.read(UnitId::Tile(tile)).unwrap()
}

fn over_tiles(cloud: &PointCloud, grid: TileGrid) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign::default());
    let tiles = tiles_of(&mut store, cloud, grid);
    for tile in &tiles {
        store.run::<GroundStage>(UnitId::Tile(*tile), None, &GroundParams::default()).unwrap();
    }
    for tile in &tiles {
        store.run::<DtmStage>(UnitId::Tile(*tile), None, &DtmParams::default()).unwrap();
    }
    let mut outcome = Outcome::default();
    tiles.iter().for_each(|tile| collect(&mut outcome, &store, *tile));
    outcome
}

fn collect(outcome: &mut Outcome, store: &Alone, tile: TileId) {
    let cloud = file::<PointTile>(store, tile).cloud;
    let ground = file::<GroundPoints>(store, tile).ground;
    for (i, height) in file::<Heights>(store, tile).height_m.iter().enumerate() {
        let is_ground = ground.binary_search(&(i as u32)).is_ok();
        outcome.points.insert(cloud.world(i).map(ticks_from_world), (height.to_bits(), is_ground));
    }
    let raster = file::<GroundModel>(store, tile).raster;
    for row in 0..raster.rows {
        for column in 0..raster.columns {
            let cell = [raster.column0 + i64::from(column), raster.row0 + i64::from(row)];
            let elevation = raster.values[raster.index(column, row)];
            if elevation.is_finite() {
                outcome.cells.insert(cell, elevation.to_bits());
            }
        }
    }
}

#[test]
fn cut_as_you_like() {
    let cloud = cloud_of(&forest(24_000, 120.0), Frame::new([481_200, 3_813_000, 0]));
    let one = over_tiles(&cloud, TileGrid::new(256, [481_100, 3_812_950]).unwrap());
    let many = over_tiles(&cloud, TileGrid::new(50, [17, -9]).unwrap());
    assert_eq!(one.points, many.points);
    assert_eq!(one.cells, many.cells);
    assert!(one.points.values().filter(|(_, is_ground)| *is_ground).count() > 4000);
    assert!(one.points.values().all(|(bits, _)| f32::from_bits(*bits).is_finite()));
}

/// A river of 24 m is narrower than the widest gap, a lake of 44 m is not.
#[test]
fn the_raster_spans_narrow_gaps_and_ends_with_the_points() {
    for (water_m, spanned) in [(24.0, true), (44.0, false)] {
        let dry = |p: &[f64; 3]| (p[0] - ORIGIN[0] - 60.0).abs() > water_m / 2.0;
        let points: Vec<[f64; 3]> = forest(24_000, 120.0).into_iter().filter(dry).collect();
        let cloud = cloud_of(&points, Frame::new([481_200, 3_813_000, 0]));
        let found = over_tiles(&cloud, TileGrid::new(64, [481_180, 3_812_980]).unwrap());
        let has_value = |x: f64, y: f64| {
            let cell = [ORIGIN[0] + x, ORIGIN[1] + y].map(|v| (v / 0.5).floor() as i64);
            found.cells.contains_key(&cell)
        };
        assert!(has_value(20.2, 60.2) && has_value(100.2, 60.2));
        assert_eq!(has_value(60.2, 60.2), spanned, "{water_m} m of water");
        assert!(!has_value(-1.0, 60.2) && !has_value(60.2, 121.0));
    }
}

#[test]
fn a_stored_model_gives_the_heights_again() {
    let cloud = cloud_of(&forest(6_000, 60.0), Frame::new([481_200, 3_813_000, 0]));
    let grid = TileGrid::new(32, [0, 0]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign::default());
    let tiles = tiles_of(&mut store, &cloud, grid);
    for tile in &tiles {
        store.run::<GroundStage>(UnitId::Tile(*tile), None, &GroundParams::default()).unwrap();
    }
    let tile = grid.tile_at(ORIGIN[0] + 20.0, ORIGIN[1] + 20.0);
    store.run::<DtmStage>(UnitId::Tile(tile), None, &DtmParams::default()).unwrap();
    let distance = DtmParams::default().max_distance_m;
    let surface = surface_of(&file::<GroundModel>(&store, tile), grid.rect(tile), distance);
    let points = file::<PointTile>(&store, tile).cloud;
    for (i, height) in file::<Heights>(&store, tile).height_m.iter().enumerate() {
        let [x, y, z] = points.world(i);
        assert_eq!((z - surface.at([x, y])) as f32, *height);
    }
}
