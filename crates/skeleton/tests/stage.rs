//! The stage on one tree.
#![allow(clippy::unwrap_used, reason = "a test may stop at what it did not expect")]

mod common;

use common::{add, fork, scan};
use timberline_artefact::alone::Alone;
use timberline_artefact::kinds::{
    BaseSource, Consolidated, Consolidation, Skeletons, Stem, TreeCloud,
};
use timberline_artefact::stage::Campaign;
use timberline_artefact::{Facts, UnitId, read_header};
use timberline_pointcloud::{Column, Frame, Point, PointCloud};
use timberline_skeleton::stage::SkeletonStage;
use timberline_skeleton::{SkeletonParams, skeleton};

const BASE_M: [f64; 3] = [500_000.0, 5_000_000.0, 1000.0];
const UNIT: UnitId = UnitId::Tree(7);

/// A forked stem in a frame near its base, without leaves and with some.
fn tree(points: &[[f64; 3]], leaves: &[[f64; 3]]) -> TreeCloud {
    let mut cloud = PointCloud::new(Frame::near(BASE_M));
    for p in points.iter().chain(leaves) {
        cloud.push_world(
            add(*p, BASE_M).map(timberline_pointcloud::frame::quantise),
            &Point::default(),
        );
    }
    let wood = (0..cloud.len()).map(|i| if i < points.len() { 1.0 } else { 0.1 }).collect();
    cloud.extra.insert(TreeCloud::WOOD.to_owned(), Column::F32(wood));
    let base_source = BaseSource::Ground;
    let bounds = timberline_pointcloud::Bounds3 { min: BASE_M, max: add(BASE_M, [2.0, 2.0, 5.0]) };
    let stem = Stem { tree_id: 7, base_m: BASE_M, base_source, dbh_m: 0.24, bounds };
    TreeCloud { stem, cloud: cloud.in_canonical_order() }
}

fn store(folder: &std::path::Path, tree: &TreeCloud, consolidated: PointCloud) -> Alone {
    let mut store = Alone::new(folder, Campaign::default());
    let facts = Facts { frame: Some(tree.cloud.frame), ..Facts::default() };
    store.put(UNIT, tree, facts.clone()).unwrap();
    let value = Consolidated { consolidation: Consolidation::default(), cloud: consolidated };
    store.put(UNIT, &value, facts).unwrap();
    store
}

#[test]
fn both_clouds_become_skeletons_in_the_frame_of_the_tree() {
    let tree = tree(&scan(&fork(), 2000.0, 0.003, 1), &[]);
    let folder = tempfile::tempdir().unwrap();
    let half: Vec<u32> = (0..tree.cloud.len() as u32).step_by(2).collect();
    let mut store = store(folder.path(), &tree, tree.cloud.select(&half));
    store.run::<SkeletonStage>(UNIT, None, &SkeletonParams::default()).unwrap();
    let found: Skeletons = store.read(UNIT).unwrap();
    let local: Vec<[f64; 3]> = (0..tree.cloud.len()).map(|i| tree.cloud.local(i)).collect();
    let direct = skeleton(&local, None, Some([0.0; 3]), &SkeletonParams::default()).unwrap();
    let positions = |nodes: &[timberline_artefact::kinds::SkeletonNode]| -> Vec<[f64; 3]> {
        nodes.iter().map(|node| node.position_m).collect()
    };
    let expected: Vec<[f64; 3]> =
        direct.skeleton.nodes.iter().map(|node| node.position_m).collect();
    assert_eq!(positions(&found.raw.nodes), expected);
    let consolidated = found.consolidated.unwrap();
    assert_ne!(positions(&consolidated.nodes), expected);
    assert!(consolidated.nodes.len() > 5);
}

#[test]
fn without_consolidated_points_there_is_one_skeleton_and_losses_are_warned_of() {
    let tree = tree(&scan(&fork(), 2000.0, 0.003, 2), &[[30.0, 0.0, 3.0], [30.0, 0.1, 3.0]]);
    let folder = tempfile::tempdir().unwrap();
    let mut store = store(folder.path(), &tree, PointCloud::new(tree.cloud.frame));
    let path = store.run::<SkeletonStage>(UNIT, None, &SkeletonParams::default()).unwrap();
    let found: Skeletons = store.read(UNIT).unwrap();
    assert_eq!(found.consolidated, None);
    let header = read_header(&path).unwrap();
    assert_eq!(header.facts.counts["points-cut-off"], 2);
    assert!(header.warnings[0].message.starts_with("2 of "), "{:?}", header.warnings);
}
