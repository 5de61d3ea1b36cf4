//! Small virtual trees, coarsely scanned.

use std::fmt::Write;
use std::sync::LazyLock;
use timberline_pointcloud::PointCloud;
use timberline_synth::terrestrial::{
    ScanParams, TreeModel, TreeSize, TreeSpecies, grow, scan_tree,
};

/// Where the trees of [`two_trees`] stand, from west to east, m.
pub(crate) const BASES_M: [[f64; 3]; 2] = [[10.0, 20.0, 5.0], [11.6, 20.4, 5.1]];

/// The first of them without ground.
pub(crate) static TREE: LazyLock<PointCloud> =
    LazyLock::new(|| scanned(&beech(BASES_M[0], 3), false));

/// A leafless beech of 12 cm.
pub(crate) fn beech(base_m: [f64; 3], seed: u64) -> TreeModel {
    let size = TreeSize::of_dbh(TreeSpecies::EuropeanBeech, 0.12).leafless();
    grow(TreeSpecies::EuropeanBeech, &size, seed).unwrap().at(base_m)
}

/// A tree seen from four positions.
pub(crate) fn scanned(tree: &TreeModel, ground: bool) -> PointCloud {
    let scan = ScanParams { step_deg: 0.3, ground, ..ScanParams::tls() };
    scan_tree(tree, &scan, 1).unwrap().thinned(0.02).cloud
}

/// Two beeches whose crowns touch, with the ground of the first or without any.
pub(crate) fn two_trees(ground: bool) -> Vec<[f64; 3]> {
    let [one, other] = BASES_M;
    let mut points = positions(&scanned(&beech(one, 3), ground));
    points.extend(positions(&scanned(&beech(other, 4), false)));
    points
}

/// The positions of a cloud's points in the world, m.
pub(crate) fn positions(cloud: &PointCloud) -> Vec<[f64; 3]> {
    (0..cloud.len()).map(|index| cloud.world(index)).collect()
}

/// Positions as text.
pub(crate) fn xyz(points: &[[f64; 3]]) -> String {
    let mut text = String::new();
    points.iter().for_each(|[x, y, z]| writeln!(text, "{x:.4} {y:.4} {z:.4}").unwrap());
    text
}
