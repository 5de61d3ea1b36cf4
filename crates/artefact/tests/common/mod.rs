//! One example of every kind.

mod of_trees;

use std::path::{Path, PathBuf};
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::*;
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Crs, Facts, Kind, Raster, UnitId};
use timberline_pointcloud::{Bounds3, Column, Frame, Point, PointCloud, TileGrid, TileId};

pub(crate) const TILE: TileId = TileId { ix: 7, iy: -2 };

pub(crate) fn unit() -> UnitId {
    UnitId::Tile(TILE)
}

pub(crate) fn facts(frame: Frame) -> Facts {
    Facts {
        crs: Some(Crs { epsg: Some(26910), name: "NAD83 / UTM 10N".into(), ..Crs::default() }),
        frame: Some(frame),
        bounds: Some(Bounds3 { min: [448.0, -128.0, 1.5], max: [511.9, -64.5, 40.25] }),
        grid: Some(TileGrid { edge_m: 64, origin_m: [0, 0] }),
        ..Facts::default()
    }
    .count("points", 500)
}

/// 500 points without a pattern, by a linear congruential sequence.
pub(crate) fn cloud() -> PointCloud {
    let mut state = 12345u64;
    let mut next = |limit: u64| {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) % limit
    };
    let mut cloud = PointCloud::new(Frame::new([448, -128, 1]));
    cloud.extra.insert("label".into(), Column::F64(vec![]));
    for index in 0..500u16 {
        let local = [next(640_000), next(640_000), next(400_000)].map(|n| n as f64 / 1e4);
        let world = [448.0 + local[0], -128.0 + local[1], 1.0 + local[2]]
            .map(timberline_pointcloud::frame::quantise);
        let point = Point {
            intensity: next(60_000) as u16,
            return_number: 1,
            number_of_returns: 2,
            classification: next(3) as u8,
            flags: 1,
            scan_angle_deg: -7.5,
            gps_time: 1e8 + f64::from(index),
            source_id: index,
        };
        cloud.push_world(world, &point);
    }
    cloud.extra.insert("label".into(), Column::F64((0..500).map(f64::from).collect()));
    cloud.in_canonical_order()
}

pub(crate) fn tree() -> Tree {
    Tree {
        id: 42,
        apex_m: [450.5, -100.25, 30.0],
        ground_m: 2.5,
        height_m: 27.5,
        position_m: [450.4, -100.3],
        position_method: PositionMethod::L1,
        position_extent_m: 0.05,
        position_standard_error_m: 0.1,
        surface_centre_m: [450.4, -100.3],
        surface_apex_m: 29.5,
        semi_axes_m: [1.75, 1.5],
        rotation_deg: 22.5,
        fit_cells: 40,
        fit_objective_m: 8.0,
        fit_residual_m: 0.2,
        fit_gap: 1e-9,
        fit_nodes: 5,
        parameters: [0.5, 0.1],
        crown_radius_m: 2.5,
        inliers: 77,
        outliers: 5,
        points: 90,
        crown_area_m2: 19.6,
        crown_diameter_max_m: 5.1,
        crown_diameter_mean_m: 5.0,
        crown_base_m: 12.0,
        crown_m: vec![[449.0, -101.0], [452.0, -101.0], [450.0, -98.0]],
        flags: TreeFlag::OneSided.bit(),
        score: 0.75,
        origin: Origin::BelowCanopy,
        ..Tree::default()
    }
}

fn model() -> CrownModel {
    CrownModel {
        id: 42,
        apex_m: [450.5, -100.25, 30.0],
        height_m: 27.5,
        shape: CrownShape::Cone,
        parameters: [0.25, 0.0],
        radius_m: 2.5,
        inliers: 77,
        outliers: 5,
        tolerance_m: 0.3,
        residual_m: 0.12,
        status: CrownStatus::Accepted,
    }
}

fn ground_model() -> GroundModel {
    let rect = TileGrid { edge_m: 64, origin_m: [0, 0] }.rect(TILE);
    let mut raster = Raster::covering(&rect, 16.0);
    (0..raster.values.len()).for_each(|i| raster.values[i] = i as f64 / 4.0);
    let patch = HardyPatch {
        centre_m: [480.0, -96.0],
        edge_m: 16.0,
        datum_m: 3.0,
        offset_squared_m2: 0.25,
        trend: [0.1, 0.2, 0.3],
        nodes_m: vec![[1.0, 2.0], [-3.0, 4.0]],
        coefficients: vec![0.5, -0.5],
    };
    GroundModel { raster, patches: vec![patch] }
}

fn outputs() -> Outputs {
    let file = OutputFile { name: "trees.csv".into(), bytes: 10, hash: "ab".into() };
    Outputs { files: vec![file], totals: [("trees".to_owned(), 1)].into() }
}

/// Writes one artefact of every kind that is written whole; returns kind and path.
pub(crate) fn write_all(folder: &Path) -> Vec<(&'static str, PathBuf)> {
    let top = Treetop {
        id: 42,
        point: 3,
        apex_m: [450.5, -100.25, 30.0],
        height_m: 27.5,
        window_m: 3.0,
        prominence_m: 1.25,
        score: 0.75,
        cover_m: 4.5,
    };
    let mut store = Alone::new(folder, Campaign::default());
    let mut paths = Vec::new();
    fn put<K: Kind>(store: &mut Alone, paths: &mut Vec<(&'static str, PathBuf)>, value: &K) {
        paths.push((K::NAME, store.put(unit(), value, facts(cloud().frame)).unwrap()));
    }
    put(&mut store, &mut paths, &PointTile { cloud: cloud() });
    put(&mut store, &mut paths, &GroundPoints { ground: vec![0, 5, 9], supplied: 3 });
    put(&mut store, &mut paths, &ground_model());
    put(&mut store, &mut paths, &Heights { height_m: vec![0.0, 1.5, f32::MAX] });
    put(&mut store, &mut paths, &Treetops { tops: vec![top] });
    put(&mut store, &mut paths, &CrownModels { models: vec![model()] });
    let detection = Detection { model: model(), score: 0.75, origin: Origin::BelowCanopy };
    put(&mut store, &mut paths, &Detections { trees: vec![detection] });
    put(&mut store, &mut paths, &Labels { tree_id: vec![0, 42], score: vec![0.0, 0.9] });
    put(&mut store, &mut paths, &Trees { trees: vec![tree()] });
    put(&mut store, &mut paths, &outputs());
    put(&mut store, &mut paths, &of_trees::stems());
    put(&mut store, &mut paths, &of_trees::tree_cloud());
    put(&mut store, &mut paths, &of_trees::consolidated());
    put(&mut store, &mut paths, &of_trees::skeletons());
    put(&mut store, &mut paths, &of_trees::qsm());
    put(&mut store, &mut paths, &ModelFiles { files: of_trees::files() });
    put(&mut store, &mut paths, &PictureFiles { files: of_trees::files() });
    paths
}
