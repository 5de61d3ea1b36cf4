//! Segments of trees: true ones, and ones with the errors of an automatic segmentation.

use super::cluster::Cluster;
use super::dataset::{DatasetParams, Growth, SegmentErrors};
use crate::Error;
use timberline_pointcloud::Nearest2;
use timberline_synth::Tree;
use timberline_synth::random::Stream;

/// A side of the crown is missing.
pub const CUT: &str = "cut";
/// The crown has a bare flank.
pub const BARE: &str = "bare";
/// A part of a neighbour is in the segment.
pub const MERGED: &str = "merged";

/// Points lower than this above the foot of the stem are in no segment, m.
const LOWEST_M: f64 = 2.0;
/// Neighbours are trees whose crowns are nearer to each other than this, m.
const APART_M: f64 = 1.0;

/// A plot's trees and points.
pub(crate) struct Segmenter<'a> {
    trees: &'a [Tree],
    points: &'a [[f64; 3]],
    /// Indices of the points of every tree.
    members: Vec<Vec<u32>>,
    canopy: u16,
}

impl<'a> Segmenter<'a> {
    /// Sorts points by the number of their tree (`trees[n - 1]`; 0 for none), all in one frame.
    pub(crate) fn new(
        trees: &'a [Tree],
        points: &'a [[f64; 3]],
        labels: &[u32],
        canopy: u16,
    ) -> Self {
        let mut members = vec![Vec::new(); trees.len()];
        for (index, &label) in labels.iter().enumerate().filter(|(_, label)| **label > 0) {
            let tree = label as usize - 1;
            if points[index][2] > trees[tree].base_m[2] + LOWEST_M {
                members[tree].push(index as u32);
            }
        }
        Self { trees, points, members, canopy }
    }

    fn of(&self, tree: &Tree) -> impl Iterator<Item = [f64; 3]> + '_ {
        self.members[tree.id as usize - 1].iter().map(|&index| self.points[index as usize])
    }

    /// The segment of a tree with random errors; its reference is the foot of the stem.
    pub(crate) fn cluster(
        &self,
        tree: &Tree,
        params: &DatasetParams,
        stream: &mut Stream,
    ) -> Result<Cluster, Error> {
        let errors = &params.errors;
        let mut points: Vec<[f64; 3]> = self.of(tree).collect();
        let mut faults = Vec::new();
        if bare_flank(tree, &params.growth, &mut points, stream) {
            faults.push(BARE);
        }
        let leaked = self.leaked(tree, &points, errors, stream)?;
        let (merged, cut) = (stream.chance(errors.merged_share), stream.chance(errors.cut_share));
        points.extend(leaked);
        let part = stream.within(errors.merged_part[0], errors.merged_part[1]);
        if merged && let Some(neighbour) = self.lower_neighbour(tree) {
            points.extend(self.part_of(neighbour, tree, part));
            faults.push(MERGED);
        }
        let (normal, at) = (stream.direction(), stream.within(errors.cut_at[0], errors.cut_at[1]));
        if cut {
            let beyond = |p: &[f64; 3]| along(tree, normal, *p) > at * tree.crown.radius_m();
            points.retain(|point| !beyond(point));
            faults.push(CUT);
        }
        points.sort_by(|a, b| {
            a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]))
        });
        points.dedup();
        let reference = [tree.base_m[0], tree.base_m[1]];
        let height_m = tree.top_above_ground_m();
        Ok(Cluster { points, reference, height_m, faults, ..Cluster::default() })
    }

    /// Points of neighbours and small trees near a tree's own points.
    fn leaked(
        &self,
        tree: &Tree,
        own: &[[f64; 3]],
        errors: &SegmentErrors,
        stream: &mut Stream,
    ) -> Result<Vec<[f64; 3]>, Error> {
        let share = 2.0 * errors.leak_share * stream.unit();
        let plan: Vec<[f64; 2]> = own.iter().map(|&[x, y, _]| [x, y]).collect();
        let search = Nearest2::new(&plan)?;
        let near = |p: &[f64; 3]| {
            let reach = errors.leak_reach_m * errors.leak_reach_m;
            search.nearest(&[p[0], p[1]], 1).first().is_some_and(|n| n.squared_m2 <= reach)
        };
        let mut leaked = Vec::new();
        for other in self.trees.iter().filter(|other| self.is_neighbour(tree, other)) {
            let small = other.stand != self.canopy;
            let share = if small { errors.understorey_share } else { share };
            leaked.extend(self.of(other).filter(|p| stream.chance(share) && near(p)));
        }
        Ok(leaked)
    }

    fn is_neighbour(&self, tree: &Tree, other: &Tree) -> bool {
        let reach = tree.crown.semi_axes_m[0] + other.crown.semi_axes_m[0] + APART_M;
        let [a, b] = [tree, other].map(|tree| tree.crown.widest_centre_m());
        let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
        other.id != tree.id && dx * dx + dy * dy < reach * reach
    }

    /// The nearest tree of the canopy with a lower top among the neighbours.
    fn lower_neighbour(&self, tree: &Tree) -> Option<&Tree> {
        let lower = |other: &&Tree| {
            other.stand == self.canopy
                && other.crown.top_m[2] < tree.crown.top_m[2]
                && self.is_neighbour(tree, other)
        };
        let distance2 = |other: &Tree| {
            let (dx, dy) = (other.base_m[0] - tree.base_m[0], other.base_m[1] - tree.base_m[1]);
            dx * dx + dy * dy
        };
        let near = |a: &&Tree, b: &&Tree| distance2(a).total_cmp(&distance2(b));
        self.trees.iter().filter(lower).min_by(near)
    }

    /// The points of a tree in the share of its width that is nearest to another tree.
    fn part_of(&self, tree: &Tree, from: &Tree, share: f64) -> Vec<[f64; 3]> {
        let (dx, dy) = (tree.base_m[0] - from.base_m[0], tree.base_m[1] - from.base_m[1]);
        let length = (dx * dx + dy * dy).sqrt().max(1e-9);
        let outward = [dx / length, dy / length];
        let middle = tree.crown.widest_centre_m();
        let place =
            |p: &[f64; 3]| (p[0] - middle[0]) * outward[0] + (p[1] - middle[1]) * outward[1];
        let limit = (2.0 * share - 1.0) * tree.crown.radius_m();
        self.of(tree).filter(|point| place(point) < limit).collect()
    }
}

/// Takes the points of a random sector out of some crowns.
fn bare_flank(
    tree: &Tree,
    growth: &Growth,
    points: &mut Vec<[f64; 3]>,
    stream: &mut Stream,
) -> bool {
    let is_bare = stream.chance(growth.bare_share);
    let middle = stream.direction();
    let angle = stream.within(growth.bare_angle_deg[0], growth.bare_angle_deg[1]);
    let beyond = stream.within(growth.bare_beyond[0], growth.bare_beyond[1]);
    if is_bare {
        let cosine = libm::cos((0.5 * angle).to_radians());
        let [x, y, _] = tree.crown.top_m;
        let limit = beyond * tree.crown.radius_m();
        points.retain(|point| {
            let (dx, dy) = (point[0] - x, point[1] - y);
            let distance = (dx * dx + dy * dy).sqrt();
            distance <= limit || along(tree, middle, *point) <= cosine * distance
        });
    }
    is_bare
}

/// How far a point lies from a tree's top along a direction, m.
fn along(tree: &Tree, direction: [f64; 2], point: [f64; 3]) -> f64 {
    let [x, y, _] = tree.crown.top_m;
    (point[0] - x) * direction[0] + (point[1] - y) * direction[1]
}
