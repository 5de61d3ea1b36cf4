//! The stages `tree-pictures` and `plot-map` over two trees.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::path::Path;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{
    BaseSource, ConsolidationEffect, Dbh, Distances, Outputs, PictureFiles, Qsm, QsmBranch,
    QsmCylinder, RadiusSource, Stem, Stems, TreeCloud, TreeMetrics,
};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Facts, UnitId, tree_id};
use timberline_pointcloud::{Bounds3, Column, Frame, Point, PointCloud, frame::quantise};
use timberline_report::stage::{
    ColourBy, PlotMapParams, PlotMapStage, TreePicturesParams, TreePicturesStage,
};

/// Numbers between 0 and 1, one after the other (additive recurrence).
fn draw(i: usize, rate: f64) -> f64 {
    (i as f64 * rate).fract()
}

/// A stem 16 m high with two orders of branches; outer ones are inferred.
fn qsm(tree_id: u64, base_m: [f64; 3], frame: Frame) -> Qsm {
    let base = frame.local_from_world(base_m);
    let mut cylinders: Vec<QsmCylinder> = Vec::new();
    let mut branches = Vec::new();
    let mut grow = |at: [f64; 3],
                    way: [f64; 3],
                    radius: f64,
                    count: u32,
                    from: (Option<u32>, Option<u32>, u16)| {
        let first = cylinders.len() as u32;
        let branch = branches.len() as u32;
        let (parent, parent_branch, order) = from;
        branches.push(QsmBranch { parent: parent_branch, order, first, len: count });
        let mut start = at;
        for k in 0..count {
            let sway =
                0.25 * (draw((first + k) as usize + 1, 0.618) - 0.5) * f64::from(order.min(1));
            let end = [
                start[0] + way[0] + sway * way[1],
                start[1] + way[1] - sway * way[0],
                start[2] + way[2],
            ];
            let radius_m = radius * (1.0 - 0.85 * f64::from(k) / f64::from(count));
            let source = match (order, k % 7) {
                (0, 5) => RadiusSource::Interpolated,
                (0 | 1, _) if radius_m > 0.012 => RadiusSource::Measured,
                _ => RadiusSource::Inferred,
            };
            let parent = if k == 0 { parent } else { Some(first + k - 1) };
            cylinders.push(QsmCylinder {
                start_m: start,
                end_m: end,
                radius_m,
                radius_sd_m: 0.002,
                source,
                arc_coverage: 0.6,
                points: 50,
                parent,
                branch,
            });
            start = end;
        }
        (branch, first)
    };
    let (stem, _) = grow(base, [0.01, 0.005, 0.4], 0.17, 40, (None, None, 0));
    for i in 0..36 {
        let level = 10 + i * 3 / 4;
        let at = [
            base[0] + 0.01 * level as f64,
            base[1] + 0.005 * level as f64,
            base[2] + 0.4 * level as f64,
        ];
        let (sin, cos) = libm::sincos(i as f64 * 2.4);
        let reach = 0.34 * (1.0 - level as f64 / 46.0);
        let count = 10;
        let way = [reach * cos, reach * sin, 0.12];
        let (branch, first) = grow(at, way, 0.035, count, (Some(level as u32), Some(stem), 1));
        for side in [-1.0, 1.0] {
            let at = [at[0] + way[0] * 5.0, at[1] + way[1] * 5.0, at[2] + way[2] * 5.0];
            let way = [0.12 * cos - side * 0.12 * sin, 0.12 * sin + side * 0.12 * cos, 0.05];
            grow(at, way, 0.01, 6, (Some(first + 4), Some(branch), 2));
        }
    }
    let dbh = Dbh {
        diameter_m: 0.334,
        sd_m: 0.004,
        arc_coverage: 0.8,
        points: 300,
        source: RadiusSource::Measured,
    };
    Qsm {
        tree_id,
        base_m,
        base_source: BaseSource::Ground,
        cylinders,
        branches,
        metrics: TreeMetrics {
            dbh: Some(dbh),
            height_m: 16.2,
            stem_volume_m3: 0.62,
            thick_volume_m3: 0.08,
            thin_volume_m3: 0.05,
            ..TreeMetrics::default()
        },
        cloud_to_model: Distances {
            count: 900,
            mean_m: 0.008,
            rms_m: 0.014,
            p95_m: 0.03,
            max_m: 0.21,
        },
        model_to_cloud: Distances::default(),
        consolidation: ConsolidationEffect::default(),
    }
}

/// Points on the cylinders, and leaves at the ends of the outer ones.
fn cloud(qsm: &Qsm, frame: Frame) -> PointCloud {
    let mut cloud = PointCloud::new(frame);
    let mut wood = Vec::new();
    for (place, c) in qsm.cylinders.iter().enumerate() {
        let count = if c.branch == 0 { 120 } else { 25 };
        let leaves = qsm.branches[c.branch as usize].order > 0;
        for i in 0..count {
            let number = place * 131 + i + 1;
            let (sin, cos) = libm::sincos(draw(number, 0.7549) * std::f64::consts::TAU);
            let share = draw(number, 0.5698);
            let is_leaf = leaves && i % 2 == 0;
            let reach = if is_leaf { 0.25 * draw(number, 0.81) } else { c.radius_m };
            let at: [f64; 3] = std::array::from_fn(|axis| {
                let off =
                    [reach * cos, reach * sin, if is_leaf { 0.2 * draw(number, 0.9) } else { 0.0 }];
                c.start_m[axis] + share * (c.end_m[axis] - c.start_m[axis]) + off[axis]
            });
            cloud.push_world(frame.world_from_local(at).map(quantise), &Point::default());
            wood.push(if is_leaf { 0.1 } else { 0.95 });
        }
    }
    cloud.extra.insert(TreeCloud::WOOD.to_owned(), Column::F32(wood));
    cloud.in_canonical_order()
}

/// Two trees with models and one without.
fn campaign(folder: &Path, shift_m: f64) -> (Alone, Vec<u64>) {
    let mut alone = Alone::new(folder, Campaign { name: "Plot".to_owned(), ..Campaign::default() });
    let mut stems = Vec::new();
    for (place, x) in [0.0, 6.5, 13.0].into_iter().enumerate() {
        let base_m = [500_000.25 + x + shift_m, 5_000_000.5 + 0.3 * x, 300.125];
        let tree_id = tree_id(base_m[0], base_m[1]);
        let bounds = Bounds3 { min: base_m, max: base_m };
        let stem = Stem { tree_id, base_m, base_source: BaseSource::Ground, dbh_m: 0.33, bounds };
        stems.push(stem);
        if place < 2 {
            let frame = Frame::near(base_m);
            let facts = Facts { frame: Some(frame), ..Facts::default() };
            let qsm = qsm(tree_id, base_m, frame);
            let cloud = TreeCloud { stem, cloud: cloud(&qsm, frame) };
            alone.put(UnitId::Tree(tree_id), &cloud, facts.clone()).unwrap();
            alone.put(UnitId::Tree(tree_id), &qsm, facts).unwrap();
        }
    }
    let ids = stems.iter().map(|stem| stem.tree_id).collect();
    let stems = Stems { stems, voxel_m: 0.05, runs: Vec::new() };
    alone.put(UnitId::Campaign, &stems, Facts::default()).unwrap();
    (alone, ids)
}

fn picture(folder: &Path, shift_m: f64, params: &TreePicturesParams) -> Vec<u8> {
    let (mut alone, ids) = campaign(folder, shift_m);
    alone.run::<TreePicturesStage>(UnitId::Tree(ids[0]), None, params).unwrap();
    let mut files = alone.read::<PictureFiles>(UnitId::Tree(ids[0])).unwrap().files;
    assert_eq!((files.len(), files[0].name.as_str()), (1, "tree.png"));
    files.remove(0).bytes
}

/// Set `TIMBERLINE_KEEP_OUTPUTS` to a folder to look at the pictures.
fn keep(name: &str, bytes: &[u8]) {
    if let Ok(folder) = std::env::var("TIMBERLINE_KEEP_OUTPUTS") {
        std::fs::write(Path::new(&folder).join(name), bytes).unwrap();
    }
}

#[test]
fn a_tree_has_its_picture() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let params = TreePicturesParams::default();
    let bytes = picture(folders[0].path(), 0.0, &params);
    assert!(bytes.starts_with(b"\x89PNG"));
    keep("tree.png", &bytes);
    let by_order = TreePicturesParams { colour_by: ColourBy::Order };
    let other = picture(folders[1].path(), 0.0, &by_order);
    keep("tree-order.png", &other);
    assert_ne!(bytes, other);
}

#[test]
fn the_same_tree_is_the_same_picture() {
    let folders = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
    let params = TreePicturesParams::default();
    let [a, b] = folders.map(|folder| picture(folder.path(), 0.0, &params));
    assert!(a == b);
}

#[test]
fn the_plot_has_its_plan() {
    let folder = tempfile::tempdir().unwrap();
    let (mut alone, _) = campaign(folder.path(), 0.0);
    let params = PlotMapParams::default();
    let manifest = alone.run::<PlotMapStage>(UnitId::Campaign, None, &params).unwrap();
    let outputs = timberline_artefact::read::<Outputs>(&manifest).unwrap().1;
    assert_eq!(outputs.totals["trees"], 3);
    assert_eq!(outputs.files[0].name, "plot.png");
    keep("plot.png", &std::fs::read(alone.outputs().join("plot.png")).unwrap());
}
