//! Skeletons of level sets: the distance from the base along the branches cuts them into sections,
//! and the centres of the sections are the axis (Verroust and Lazarus 2000; Xu, Gossett and Chen
//! 2007 for trees). Here a section is as long as its branch is thick, its centre is that of a robust
//! circle where points lie on an arc, and side branches must explain points to be kept.

mod assemble;
mod axis;
mod branches;
mod circle;
mod cluster;
mod grow;
mod pieces;
mod section;

use crate::cloud::Cloud;
use crate::graph::Graph;
use crate::graph::knn::Neighbours;
use crate::kdtree::KdTree;
use crate::model::{GraphKind, Outcome, Report};
use crate::paths::{Paths, shortest};
use crate::vector::{Vector, distance};
use crate::{SkeletonParams, base};
use branches::Pruning;
use grow::{Ground, Upwards};
use pieces::{Gaps, Pieces};

/// Rank of the neighbour whose distance is the spacing at a point.
const SPACING_RANK: usize = 4;

/// The first section is this share of the tree's height.
const FIRST_SHARE: f64 = 0.02;

/// Factor on the lengths of sections that are told in spacings: that of `detail` 1 and more, with less
/// detail in proportion to the root of its inverse, up to the largest.
const FINENESS: (f64, f64) = (0.7, 2.0);

/// How much costlier an edge to leaves is. More of it, and paths leave a leader with few points,
/// which have no shape that tells wood, for the dense twigs beside it.
const LEAF_COST: f64 = 0.3;

/// The skeleton of a prepared cloud.
pub(crate) fn skeleton(
    cloud: &Cloud,
    base_m: Option<Vector>,
    params: &SkeletonParams,
    given: usize,
) -> Outcome {
    let tree = KdTree::new(&cloud.points);
    let near = Neighbours::by(&tree, &cloud.points, params.neighbours as usize, SPACING_RANK);
    let spacing_m = median(&near.spacing_m);
    let gaps = Gaps { spacing_m: &near.spacing_m, median_m: spacing_m, gap_m: params.gap_m };
    let graph = gaps.close(&near, &cloud.points);
    let pieces = Pieces::new(&tree, &cloud.points, &graph);
    drop(tree);
    let root = base::root(&cloud.points, base_m, |point| pieces.may_hold_base(point));
    let joined = pieces.join(root, &gaps);
    let graph = graph.with(&joined.bridges);
    let sources = sources(cloud, &graph, root, spacing_m);
    let paths = paths(cloud, &graph, &near.spacing_m, &sources);
    let Neighbours { spacing_m: spacing, .. } = near;
    drop(graph);
    let skeleton = build(cloud, &paths, &spacing, base_m, params);
    let reached = paths.order.iter().map(|&v| u64::from(cloud.count[v as usize])).sum::<u64>();
    let finite = (given - cloud.not_finite) as u64;
    let report = Report {
        points: given as u64,
        not_finite: cloud.not_finite as u64,
        duplicates: finite - cloud.points.len() as u64,
        cut_off: finite - reached,
        pieces_cut_off: joined.cut as u64,
        spacing_m,
        graph: GraphKind::Neighbours,
    };
    Outcome { skeleton, report }
}

fn build(
    cloud: &Cloud,
    paths: &Paths,
    spacing_m: &[f64],
    base_m: Option<Vector>,
    params: &SkeletonParams,
) -> crate::Skeleton {
    let upwards = Upwards::new(paths);
    let length_m = grow::lengths(&cloud.points, paths);
    let sources: Vec<u32> = paths
        .order
        .iter()
        .filter(|&&v| paths.parent[v as usize] == crate::paths::NONE)
        .copied()
        .collect();
    let (low, high) = cloud.heights_m();
    let ground = Ground {
        cloud,
        spacing_m,
        length_m: &length_m,
        upwards: &upwards,
        first_radius_m: base::first_radius_m(&cloud.points, &sources),
        fineness: (FINENESS.0 / params.detail.sqrt()).clamp(FINENESS.0, FINENESS.1),
        first_length_m: (FIRST_SHARE * (high - low)).max(2.0 * median(spacing_m)),
    };
    let grown = grow::grow(&ground, sources);
    let mut branches = branches::string(&grown);
    let pruning = Pruning { grown: &grown, cloud, spacing_m, detail: params.detail };
    let kept = pruning.prune(&mut branches);
    assemble::assemble(&pruning, &branches, &kept, base_m, params)
}

/// Where paths begin: the points around the root in the lowest share of the tree that are connected
/// with it there, each at its height above the lowest, so that level sets begin level.
fn sources(cloud: &Cloud, graph: &Graph, root: u32, spacing_m: f64) -> Vec<(u32, f64)> {
    let (low, high) = cloud.heights_m();
    let at = cloud.points[root as usize];
    let slab = (0.5 * FIRST_SHARE * (high - low)).max(2.0 * spacing_m);
    let reach = 2.5 * slab;
    let inside = |v: u32| {
        let p = cloud.points[v as usize];
        (p[2] - at[2]).abs() <= slab && distance([p[0], p[1], at[2]], at) <= reach
    };
    let mut seen = vec![false; cloud.points.len()];
    let mut found = vec![root];
    seen[root as usize] = true;
    let mut next = 0;
    while next < found.len() {
        for &to in graph.of(found[next]).iter().filter(|&&to| inside(to)) {
            if !std::mem::replace(&mut seen[to as usize], true) {
                found.push(to);
            }
        }
        next += 1;
    }
    found.sort_unstable();
    let lowest = found.iter().map(|&v| cloud.points[v as usize][2]).fold(f64::INFINITY, f64::min);
    found.into_iter().map(|v| (v, cloud.points[v as usize][2] - lowest)).collect()
}

/// Shortest paths where long edges are dear: an edge longer than the spacing of its ends costs the
/// cube of its length, so that paths follow the branches and do not leap between them.
fn paths(cloud: &Cloud, graph: &Graph, spacing_m: &[f64], sources: &[(u32, f64)]) -> Paths {
    shortest(graph, sources, |a, b| {
        let (i, j) = (a as usize, b as usize);
        let length = distance(cloud.points[i], cloud.points[j]);
        let spacing = 0.5 * (spacing_m[i] + spacing_m[j]);
        let over = if spacing > 0.0 { (length / spacing).max(1.0) } else { 1.0 };
        let leaf = 1.0 - 0.5 * f64::from(cloud.wood[i] + cloud.wood[j]);
        length * over * over * (1.0 + LEAF_COST * leaf)
    })
}

/// Median of numbers; 0 for none.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() {
        return 0.0;
    }
    *sorted.select_nth_unstable_by(middle, f64::total_cmp).1
}
