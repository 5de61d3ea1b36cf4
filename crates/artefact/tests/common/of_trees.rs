//! One example of every kind about single trees.

use super::{cloud, tree};
use timberline_artefact::kinds::*;
use timberline_pointcloud::{Bounds3, Column, PointCloud};

pub(crate) fn stem() -> Stem {
    Stem {
        tree_id: 42,
        base_m: [450.5, -100.25, 2.5],
        base_source: BaseSource::Ground,
        dbh_m: 0.3125,
        bounds: Bounds3 { min: [448.0, -102.5, 2.5], max: [453.0, -98.0, 30.0] },
    }
}

pub(crate) fn stems() -> Stems {
    let seen_once = Stem { base_source: BaseSource::LowestPoints, tree_id: 43, ..stem() };
    let run = |bottom, stem| VoxelRun { column: [9010, -2005], bottom, len: 12, stem };
    Stems { stems: vec![stem(), seen_once], voxel_m: 0.05, runs: vec![run(50, 0), run(70, 1)] }
}

/// Number of points: a few, for every byte of the file is tried.
const POINTS: u16 = 40;

fn with_column(name: &str, column: Column) -> PointCloud {
    let mut cloud = cloud().select(&(0..u32::from(POINTS)).collect::<Vec<_>>());
    cloud.extra.insert(name.to_owned(), column);
    cloud
}

pub(crate) fn tree_cloud() -> TreeCloud {
    let wood = (0..POINTS).map(|i| f32::from(i) / 64.0).collect();
    TreeCloud { stem: stem(), cloud: with_column(TreeCloud::WOOD, Column::F32(wood)) }
}

pub(crate) fn consolidated() -> Consolidated {
    let consolidation = Consolidation {
        skipped: None,
        points_before: 510,
        points_after: 500,
        points_left_alone: 20,
        thickness_before_m: 0.004,
        thickness_after_m: 0.001,
        distance_before_m: 0.003,
        mean_shift_m: 0.002,
    };
    let stem = (0..POINTS).map(|i| u8::from(i % 3 == 0)).collect();
    Consolidated { consolidation, cloud: with_column(Consolidated::STEM, Column::U8(stem)) }
}

pub(crate) fn skeletons() -> Skeletons {
    let node = |z: f64, parent, points| SkeletonNode {
        position_m: [2.5, 27.75, z],
        parent,
        radius_m: 0.1,
        points,
    };
    let raw = Skeleton { nodes: vec![node(1.5, None, 0), node(3.5, Some(0), 70)] };
    Skeletons { consolidated: Some(Skeleton { nodes: raw.nodes[..1].to_vec() }), raw }
}

fn cylinders() -> Vec<QsmCylinder> {
    let lower = QsmCylinder {
        start_m: [2.5, 27.75, 1.5],
        end_m: [2.5, 27.75, 3.5],
        radius_m: 0.16,
        radius_sd_m: 0.002,
        source: RadiusSource::Measured,
        arc_coverage: 0.75,
        points: 300,
        parent: None,
        branch: 0,
    };
    let upper = QsmCylinder {
        start_m: lower.end_m,
        end_m: [2.75, 27.75, 5.0],
        radius_m: 0.02,
        radius_sd_m: f64::NAN,
        source: RadiusSource::Inferred,
        arc_coverage: 0.0,
        points: 0,
        parent: Some(0),
        branch: 1,
    };
    vec![lower, upper]
}

fn metrics() -> TreeMetrics {
    let source = RadiusSource::Measured;
    let dbh = Dbh { diameter_m: 0.31, sd_m: 0.003, arc_coverage: 0.75, points: 120, source };
    TreeMetrics {
        dbh: Some(dbh),
        height_m: 27.5,
        crown_base_m: None,
        crown_area_m2: tree().crown_area_m2,
        crown_diameter_m: 5.0,
        stem_volume_m3: 0.75,
        thick_volume_m3: 0.0,
        thin_volume_m3: 0.01,
        surface_m2: 2.5,
        length_m: 3.5,
        taper: vec![TaperStep { height_m: 1.0, diameter_m: 0.32, source }],
    }
}

pub(crate) fn qsm() -> Qsm {
    let branch = |parent, order, first| QsmBranch { parent, order, first, len: 1 };
    let distances = |mean_m| Distances { count: 500, mean_m, rms_m: 0.01, p95_m: 0.02, max_m: 0.1 };
    Qsm {
        tree_id: 42,
        base_m: stem().base_m,
        base_source: BaseSource::Ground,
        cylinders: cylinders(),
        branches: vec![branch(None, 0, 0), branch(Some(0), 1, 1)],
        metrics: metrics(),
        cloud_to_model: distances(0.008),
        model_to_cloud: distances(0.006),
        consolidation: ConsolidationEffect {
            used: false,
            reason: "the points as scanned are nearer".to_owned(),
            raw_mean_m: 0.008,
            consolidated_mean_m: 0.009,
        },
    }
}

pub(crate) fn files() -> Vec<TreeFile> {
    let file = |name: &str, bytes: &[u8]| TreeFile { name: name.into(), bytes: bytes.to_vec() };
    vec![file("qsm.csv", b"cylinder\n1\n"), file("tree.ply", b"ply\n\xff")]
}
