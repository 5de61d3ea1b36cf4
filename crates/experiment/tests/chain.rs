//! The chain of the experiments is that of the stages.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeMap;
use timberline_artefact::UnitId;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{Detections, GroundPoints, Heights};
use timberline_artefact::stage::Campaign;
use timberline_crowns::stage::{CrownModelStage, DetectionStage};
use timberline_experiment::segmentation::{Case, Chain, Experiment, Plot, StandKind};
use timberline_pointcloud::{TileGrid, TileId};
use timberline_treetops::stage::TreetopsStage;

/// The detected trees of a plot by the stages, tile by tile: ids and bits of scores, sorted.
fn by_stages(plot: &Plot, chain: &Chain) -> Vec<(u64, u32)> {
    let folder = tempfile::tempdir().unwrap();
    let grid = TileGrid::new(32, [0, 0]).unwrap();
    let campaign = Campaign { grid: Some(grid), ..Campaign::default() };
    let mut alone = Alone::new(folder.path(), campaign);
    let mut heights: BTreeMap<TileId, Vec<f32>> = BTreeMap::new();
    for (index, height_m) in plot.height_m.iter().enumerate() {
        let [x, y, _] = plot.cloud.world(index);
        heights.entry(grid.tile_at(x, y)).or_default().push(*height_m);
    }
    let tiles = alone.put_tiles(&plot.cloud, grid).unwrap();
    for (tile, _, facts) in &tiles {
        let unit = UnitId::Tile(*tile);
        let height_m = heights.remove(tile).unwrap();
        alone.put(unit.clone(), &Heights { height_m }, facts.clone()).unwrap();
        alone.put(unit, &GroundPoints::default(), facts.clone()).unwrap();
    }
    let units: Vec<UnitId> = tiles.iter().map(|(tile, ..)| UnitId::Tile(*tile)).collect();
    for unit in &units {
        alone.run::<TreetopsStage>(unit.clone(), None, &chain.treetops).unwrap();
    }
    for unit in &units {
        alone.run::<CrownModelStage>(unit.clone(), None, &chain.crown_models).unwrap();
    }
    let mut found = Vec::new();
    for unit in &units {
        alone.run::<DetectionStage>(unit.clone(), None, &chain.detection).unwrap();
        let Detections { trees } = alone.read(unit.clone()).unwrap();
        found.extend(trees.iter().map(|tree| (tree.model.id, tree.score.to_bits())));
    }
    found.sort_unstable();
    found
}

#[test]
fn its_trees_are_those_of_the_stages_to_the_last_bit() {
    for stand in [StandKind::MultilayerMixed, StandKind::Broadleaf] {
        let experiment = Experiment { judged_edge_m: 40.0, slope_deg: 20.0, ..Default::default() };
        let case = Case { stand, density_per_m2: 8.0, repeat: 1 };
        let plot = Plot::generate(&experiment, &case).unwrap();
        let chain = Chain::default();
        let markers = chain.markers(&plot).unwrap();
        let found: Vec<(u64, u32)> =
            markers.iter().map(|marker| (marker.crown.id, marker.score.to_bits())).collect();
        assert!(found.len() > 30, "{}", found.len());
        assert_eq!(found, by_stages(&plot, &chain));
    }
}
