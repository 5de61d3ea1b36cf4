//! The stages over tiles: the same ground, terrain and heights however the campaign is cut.

#![allow(clippy::unwrap_used, reason = "these are tests")]

mod forest;

use forest::{ORIGIN, cloud_of, forest};
use std::collections::BTreeMap;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{GroundModel, GroundPoints, Heights, PointTile};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Facts, Kind, UnitId, read};
use timberline_ground::stage::{DtmStage, GroundStage, surface_of};
use timberline_ground::{DtmParams, GroundParams};
use timberline_pointcloud::frame::ticks_from_world;
use timberline_pointcloud::{Frame, PointCloud, TileGrid, TileId};

/// What the stages say about every point and raster cell of the campaign.
#[derive(Debug, Default, PartialEq)]
struct Outcome {
    /// Bits of the height, and whether it is ground, by position.
    points: BTreeMap<[i64; 3], (u32, bool)>,
    /// Bits of the elevation by world cell.
    cells: BTreeMap<[i64; 2], u64>,
}

fn tiles_of(store: &mut Alone, cloud: &PointCloud, grid: TileGrid) -> Vec<TileId> {
    let tile_of = |i: u32| {
        let [x, y, _] = cloud.world(i as usize);
        grid.tile_at(x, y)
    };
    let mut tiles: Vec<TileId> = (0..cloud.len() as u32).map(tile_of).collect();
    tiles.sort_unstable();
    tiles.dedup();
    for &tile in &tiles {
        let own: Vec<u32> = (0..cloud.len() as u32).filter(|&i| tile_of(i) == tile).collect();
        let part = cloud.select(&own);
        let lowest = (0..part.len()).map(|i| part.world(i)[2]).fold(f64::INFINITY, f64::min);
        let part = part.in_frame(PointTile::frame(&grid, tile, lowest));
        let facts = Facts { frame: Some(part.frame), grid: Some(grid), ..Facts::default() };
        let facts = facts.count("points", part.len());
        store.put(UnitId::Tile(tile), &PointTile { cloud: part }, facts).unwrap();
    }
    tiles
}

fn file<K: Kind>(store: &Alone, tile: TileId) -> K {
    let unit = UnitId::Tile(tile);
    let found = store.files.iter().find(|file| file.kind == K::NAME && file.unit == unit).unwrap();
    read(&found.path).unwrap().1
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
            outcome.cells.insert(cell, raster.values[raster.index(column, row)].to_bits());
        }
    }
}

#[test]
fn cut_as_you_like() {
    let cloud = cloud_of(&forest(24_000, 120.0), Frame::new([481_200, 3_813_000, 0]));
    let one = over_tiles(&cloud, TileGrid::new(256, [481_100, 3_812_950]).unwrap());
    let many = over_tiles(&cloud, TileGrid::new(50, [17, -9]).unwrap());
    assert_eq!(one.points, many.points);
    for (cell, bits) in &many.cells {
        // Whole tiles have cells beyond the points; those of one grid need not be in the other.
        if let Some(other) = one.cells.get(cell) {
            assert_eq!(bits, other, "cell {cell:?}");
        }
    }
    assert!(one.points.values().filter(|(_, is_ground)| *is_ground).count() > 4000);
    assert!(one.points.values().all(|(bits, _)| f32::from_bits(*bits).is_finite()));
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
