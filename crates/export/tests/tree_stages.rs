//! The stages `tree-models` and `tree-tables` over a small plot.
//!
//! `TIMBERLINE_ORACLE=python3 cargo test -p timberline-export --test tree_stages -- --ignored` gives the files
//! to independent readers (packages of `.ci/requirements.txt`).

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeMap;
use std::path::Path;
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{
    BaseSource, ConsolidationEffect, Dbh, Distances, ModelFiles, Outputs, PictureFiles, Qsm,
    QsmBranch, QsmCylinder, RadiusSource, Skeleton, SkeletonNode, Skeletons, Stem, Stems,
    TaperStep, TreeCloud, TreeFile, TreeMetrics,
};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Crs, Facts, Header, UnitId, tree_id};
use timberline_export::stage::{
    TreeModelsParams, TreeModelsStage, TreeTablesParams, TreeTablesStage,
};
use timberline_pointcloud::{Bounds3, Column, Frame, Point, PointCloud};

/// Bases of three stems; the last one has no model.
const BASES: [[f64; 3]; 3] = [
    [500_000.25, 5_000_000.75, 1_000.125],
    [500_010.5, 5_000_004.5, 1_001.5],
    [500_020.0, 5_000_000.0, 1_002.0],
];

fn cylinder(start_m: [f64; 3], end_m: [f64; 3], radius_m: f64, parent: Option<u32>) -> QsmCylinder {
    QsmCylinder {
        start_m,
        end_m,
        radius_m,
        radius_sd_m: 0.002,
        source: RadiusSource::Measured,
        arc_coverage: 0.75,
        points: 100,
        parent,
        branch: 0,
    }
}

/// A stem 12 m high that leans a little and 20 branches of three cylinders, the outer ones inferred.
fn qsm(tree_id: u64, base_m: [f64; 3], frame: Frame) -> Qsm {
    let base = frame.local_from_world(base_m);
    let at = |z: f64| [base[0] + 0.01 * z, base[1] - 0.005 * z, base[2] + z];
    let mut cylinders: Vec<QsmCylinder> = (0..24u32)
        .map(|i| {
            let z = f64::from(i) * 0.5;
            let parent = i.checked_sub(1);
            cylinder(at(z), at(z + 0.5), 0.2 - 0.16 * z / 12.0, parent)
        })
        .collect();
    let mut branches = vec![QsmBranch { parent: None, order: 0, first: 0, len: 24 }];
    for i in 0..20u32 {
        let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
        let first = cylinders.len() as u32;
        let mut start = at(f64::from(i) * 0.5 + 2.0);
        for k in 0..3u32 {
            let lift = 0.3 - 0.1 * f64::from(k);
            let end = [start[0] + 0.5 * cos, start[1] + 0.5 * sin, start[2] + lift];
            let parent = if k == 0 { i + 3 } else { first + k - 1 };
            let mut one = cylinder(start, end, 0.03 - 0.008 * f64::from(k), Some(parent));
            one.branch = i + 1;
            if k == 2 {
                (one.source, one.radius_sd_m, one.points) = (RadiusSource::Inferred, f64::NAN, 0);
            }
            cylinders.push(one);
            start = end;
        }
        branches.push(QsmBranch { parent: Some(0), order: 1, first, len: 3 });
    }
    let dbh = Dbh {
        diameter_m: 0.37,
        sd_m: 0.003,
        arc_coverage: 0.75,
        points: 200,
        source: RadiusSource::Measured,
    };
    let taper = vec![TaperStep { height_m: 1.0, diameter_m: 0.37, source: RadiusSource::Measured }];
    Qsm {
        tree_id,
        base_m,
        base_source: BaseSource::Ground,
        cylinders,
        branches,
        metrics: TreeMetrics { dbh: Some(dbh), height_m: 12.0, taper, ..TreeMetrics::default() },
        cloud_to_model: Distances { count: 9, mean_m: 0.01, rms_m: 0.02, p95_m: 0.03, max_m: 0.05 },
        model_to_cloud: Distances::default(),
        consolidation: ConsolidationEffect::default(),
    }
}

/// Points on the stem.
fn cloud(base_m: [f64; 3], frame: Frame) -> PointCloud {
    let mut cloud = PointCloud::new(frame);
    for i in 0..500 {
        let (sin, cos) = libm::sincos(f64::from(i) * 2.4);
        let z = f64::from(i) * 0.02;
        let offset = [0.2 * cos, 0.2 * sin, z];
        let world = std::array::from_fn(|axis| base_m[axis] + offset[axis]);
        let point = Point { intensity: i as u16, ..Point::default() };
        cloud.push_world(world.map(timberline_pointcloud::frame::quantise), &point);
    }
    cloud.extra.insert(TreeCloud::WOOD.to_owned(), Column::F32(vec![0.9; cloud.len()]));
    cloud.in_canonical_order()
}

fn skeleton(qsm: &Qsm) -> Skeleton {
    let root = SkeletonNode {
        position_m: qsm.cylinders[0].start_m,
        parent: None,
        radius_m: 0.2,
        points: 0,
    };
    let node = |c: &QsmCylinder| SkeletonNode {
        position_m: c.end_m,
        parent: Some(c.parent.map_or(0, |parent| parent + 1)),
        radius_m: c.radius_m,
        points: c.points,
    };
    Skeleton { nodes: std::iter::once(root).chain(qsm.cylinders.iter().map(node)).collect() }
}

/// The campaign before both stages, with two of three trees modelled.
fn campaign(folder: &Path, shift_m: [f64; 3]) -> (Alone, Vec<u64>) {
    let mut alone = Alone::new(folder, Campaign { name: "plot".to_owned(), ..Campaign::default() });
    let crs = Crs { name: "EPSG:25832".to_owned(), epsg: Some(25832), ..Crs::default() };
    let mut stems = Vec::new();
    for (place, base_m) in BASES.into_iter().enumerate() {
        let base_m: [f64; 3] = std::array::from_fn(|axis| base_m[axis] + shift_m[axis]);
        let tree_id = tree_id(base_m[0], base_m[1]);
        let bounds = Bounds3 { min: base_m, max: base_m.map(|value| value + 12.0) };
        let stem = Stem { tree_id, base_m, base_source: BaseSource::Ground, dbh_m: 0.37, bounds };
        stems.push(stem);
        if place == 2 {
            continue;
        }
        let frame = Frame::near(base_m);
        let facts = Facts {
            crs: Some(crs.clone()),
            frame: Some(frame),
            bounds: Some(bounds),
            ..Facts::default()
        };
        let unit = UnitId::Tree(tree_id);
        let qsm = qsm(tree_id, base_m, frame);
        let skeletons = Skeletons { raw: skeleton(&qsm), consolidated: None };
        let cloud = TreeCloud { stem, cloud: cloud(base_m, frame) };
        alone.put(unit.clone(), &cloud, facts.clone()).unwrap();
        alone.put(unit.clone(), &skeletons, facts.clone()).unwrap();
        alone.put(unit.clone(), &qsm, facts.clone()).unwrap();
        let picture = TreeFile { name: "tree.png".to_owned(), bytes: vec![1, 2, 3] };
        alone.put(unit, &PictureFiles { files: vec![picture] }, facts).unwrap();
    }
    stems.sort_by_key(|stem| stem.tree_id);
    let ids = stems.iter().map(|stem| stem.tree_id).collect();
    let facts = Facts { crs: Some(crs), ..Facts::default() };
    let stems = Stems { stems, voxel_m: 0.05, runs: Vec::new() };
    alone.put(UnitId::Campaign, &stems, facts).unwrap();
    (alone, ids)
}

/// Runs both stages; returns the header and payload of the manifest.
fn run(alone: &mut Alone, ids: &[u64]) -> (Header, Outputs) {
    for tree_id in &ids[..2] {
        let params =
            TreeModelsParams { watertight_triangles: 60_000, ..TreeModelsParams::default() };
        alone.run::<TreeModelsStage>(UnitId::Tree(*tree_id), None, &params).unwrap();
    }
    let params = TreeTablesParams::default();
    let manifest = alone.run::<TreeTablesStage>(UnitId::Campaign, None, &params).unwrap();
    timberline_artefact::read::<Outputs>(&manifest).unwrap()
}

const TREE_FILES: [&str; 12] = [
    "branches.csv",
    "metrics.json",
    "qsm.csv",
    "taper.csv",
    "tree.glb",
    "tree.mcap",
    "tree.obj",
    "tree.ply",
    "tree.png",
    "tree.txt",
    "tree_watertight.ply",
    "treeqsm.csv",
];

#[test]
fn every_tree_has_its_folder_and_the_plot_its_tables() {
    let folder = tempfile::tempdir().unwrap();
    let (mut alone, ids) = campaign(folder.path(), [0.0; 3]);
    let (header, outputs) = run(&mut alone, &ids);
    assert_eq!(outputs.totals["trees"], 2);
    assert_eq!(outputs.totals["trees found"], 3);
    assert_eq!(outputs.totals["trees without a model"], 1);
    assert_eq!(header.warnings.len(), 1);
    assert_eq!(header.warnings[0].subject, format!("tree {}", ids[2]));
    for tree_id in &ids[..2] {
        let folder = alone.outputs().join(format!("trees/{tree_id}"));
        let mut names: Vec<String> = std::fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, TREE_FILES);
    }
    let text = |name: &str| std::fs::read_to_string(alone.outputs().join(name)).unwrap();
    assert_eq!(text("trees.csv").lines().count(), 3);
    assert_eq!(text("qsm.csv").lines().count(), 1 + 2 * 84);
    assert_eq!(text("branches.csv").lines().count(), 1 + 2 * 2);
    assert_eq!(text("taper.csv").lines().count(), 3);
    for file in &outputs.files {
        assert!(alone.outputs().join(&file.name).exists(), "{}", file.name);
    }
}

/// What a file of the first tree holds.
fn files(shift_m: [f64; 3], threads: usize) -> BTreeMap<String, Vec<u8>> {
    let folder = tempfile::tempdir().unwrap();
    let (mut alone, ids) = campaign(folder.path(), shift_m);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| run(&mut alone, &ids));
    let files = alone.read::<ModelFiles>(UnitId::Tree(ids[0])).unwrap().files;
    files.into_iter().map(|file| (file.name, file.bytes)).collect()
}

#[test]
fn one_and_two_threads_write_the_same_bytes() {
    assert!(files([0.0; 3], 1) == files([0.0; 3], 2));
}

#[test]
fn whole_metres_change_no_mesh() {
    let (here, there) = (files([0.0; 3], 2), files([1000.0, -4000.0, 50.0], 2));
    let body = |bytes: &[u8]| {
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap();
        bytes[end..].to_vec()
    };
    for name in ["tree.ply", "tree_watertight.ply"] {
        assert!(body(&here[name]) == body(&there[name]), "{name}");
    }
    assert_eq!(here["taper.csv"].len(), there["taper.csv"].len());
}

/// An independent reader for every format, see `oracle/check_trees.py`.
#[test]
#[ignore = "needs Python with the packages of .ci/requirements.txt"]
fn independent_readers_read_everything() {
    let python = std::env::var("TIMBERLINE_ORACLE").unwrap_or_else(|_| "python3".to_owned());
    let folder = tempfile::tempdir().unwrap();
    let (mut alone, ids) = campaign(folder.path(), [0.0; 3]);
    run(&mut alone, &ids);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/oracle/check_trees.py");
    let status = std::process::Command::new(python).arg(script).arg(alone.outputs()).status();
    assert!(status.unwrap().success());
}
