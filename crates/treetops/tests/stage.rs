//! The stage over tiles: the same trees however the campaign is cut.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    reason = "these are tests"
)]

use proptest::prelude::*;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{GroundPoints, Heights, Treetop, Treetops};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Facts, UnitId, read, tree_id};
use timberline_pointcloud::{Frame, Point, PointCloud, TileGrid, TileId, frame};
use timberline_treetops::stage::TreetopsStage;
use timberline_treetops::{Input, Method, Params, RankBy, find};

/// Points of a bumpy slope around tile borders: x, y in decimetres, z in decimetres.
fn campaign(raw: &[(i32, i32, i32)]) -> PointCloud {
    let mut cloud = PointCloud::new(Frame::new([4_096, 8_192, 100]));
    for &(x, y, z) in raw {
        let world = [
            4_128.0 + f64::from(x) * 0.1,
            8_224.0 + f64::from(y) * 0.1,
            120.0 + f64::from(z) * 0.1,
        ];
        cloud.push_world(world.map(frame::quantise), &Point::default());
    }
    cloud.in_canonical_order()
}

fn height_of(cloud: &PointCloud, index: usize) -> f32 {
    (cloud.world(index)[2] - 115.0) as f32
}

/// Runs the stage on every tile of a grid and gathers all treetops.
fn over_tiles(cloud: &PointCloud, grid: TileGrid, params: &Params) -> Vec<Treetop> {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Alone::new(folder.path(), Campaign::default());
    let tiles = store.put_tiles(cloud, grid).unwrap();
    for (tile, part, facts) in &tiles {
        let height_m = (0..part.len()).map(|i| height_of(part, i)).collect();
        let unit = UnitId::Tile(*tile);
        store.put(unit.clone(), &Heights { height_m }, facts.clone()).unwrap();
        store.put(unit, &GroundPoints::default(), facts.clone()).unwrap();
    }
    let run = |(tile, ..): &(TileId, PointCloud, Facts)| {
        let path = store.run::<TreetopsStage>(UnitId::Tile(*tile), None, params).unwrap();
        read::<Treetops>(&path).unwrap().1.tops
    };
    let mut tops: Vec<Treetop> = tiles.iter().flat_map(run).collect();
    tops.sort_by_key(|top| top.id);
    tops
}

/// What tells a treetop apart, its index in the tile aside, to the bit.
type Bits = (u64, [f64; 3], [u64; 3], [u32; 2]);

fn facts_of(tops: &[Treetop]) -> Vec<Bits> {
    let bits = |t: &Treetop| [t.height_m, t.window_m, t.prominence_m].map(f64::to_bits);
    let scores = |t: &Treetop| [t.score, t.cover_m].map(f32::to_bits);
    tops.iter().map(|t| (t.id, t.apex_m, bits(t), scores(t))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]

    #[test]
    fn cut_as_you_like(
        raw in prop::collection::vec((-320i32..320, -320i32..320, 0i32..150), 100..400),
        origin in -40i64..40, elevation in any::<bool>(), evidence in any::<bool>(),
    ) {
        let cloud = campaign(&raw);
        let rank_by = if elevation { RankBy::Elevation } else { RankBy::Height };
        let method = if evidence { Method::Evidence } else { Method::Window };
        let params =
            Params { method, min_score: 0.0, rank_by, support_radius_m: 5.0, ..Params::default() };
        let height_m: Vec<f32> = (0..cloud.len()).map(|i| height_of(&cloud, i)).collect();
        let mut whole: Vec<Treetop> = find(&Input::new(&cloud, &height_m), &params)
            .unwrap()
            .iter()
            .map(|top| Treetop {
                id: tree_id(top.world_m[0], top.world_m[1]),
                point: top.index,
                apex_m: top.world_m,
                height_m: top.height_m,
                window_m: top.window_m,
                prominence_m: top.prominence_m,
                score: top.score as f32,
                cover_m: top.cover_m as f32,
            })
            .collect();
        whole.sort_by_key(|top| top.id);
        for (edge_m, origin_m) in [(32, [0, 0]), (16, [origin, -origin]), (64, [origin, 0])] {
            let grid = TileGrid::new(edge_m, origin_m).unwrap();
            prop_assert_eq!(facts_of(&over_tiles(&cloud, grid, &params)), facts_of(&whole));
        }
    }
}
