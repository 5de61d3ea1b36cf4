//! Sections strung into branches, and which branches are worth keeping.

use super::grow::Grown;
use crate::cloud::Cloud;
use crate::paths::NONE;
use crate::vector::{Vector, distance, dot, to_segment};

/// What a branch must explain at `detail` 1: the distances of its points from the surface of the
/// branch it leaves, in spacings, added up. Measured: see `tests/real.rs`.
const EXPLAINED_SPACINGS: f64 = 5.0;

/// Fewest points of a branch at `detail` 1.
const FEWEST_POINTS: f64 = 3.0;

/// Sections before and after the fork that a point may be nearest to instead.
const AROUND_FORK: usize = 6;

/// A run of sections from a fork to a tip.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Branch {
    /// From base to tip.
    pub(crate) sections: Vec<u32>,
    /// The branch it leaves; [`NONE`] for the stem.
    pub(crate) parent: u32,
    /// Place in the sections of that branch.
    pub(crate) fork: u32,
    /// Points of branches on it that were not worth keeping, with the place of their fork.
    pub(crate) absorbed: Vec<(u32, u32)>,
}

/// Strings the sections into branches, each after the one it leaves. At a fork the branch goes on
/// where most length lies ahead, a bend counting against it.
pub(crate) fn string(grown: &Grown) -> Vec<Branch> {
    let children = children(grown);
    let ahead = lengths_ahead(grown);
    let mut branches = Vec::new();
    let mut open = vec![(0u32, NONE, 0u32)];
    while let Some((first, parent, fork)) = open.pop() {
        let own = branches.len() as u32;
        let mut sections = vec![first];
        let mut at = first;
        while let Some(on) = goes_on(grown, &children[at as usize], at, &ahead) {
            let place = sections.len() as u32 - 1;
            let others = children[at as usize].iter().filter(|&&child| child != on);
            open.extend(others.map(|&child| (child, own, place)));
            sections.push(on);
            at = on;
        }
        branches.push(Branch { sections, parent, fork, absorbed: Vec::new() });
    }
    branches
}

fn children(grown: &Grown) -> Vec<Vec<u32>> {
    let mut children = vec![Vec::new(); grown.sections.len()];
    for (place, section) in grown.sections.iter().enumerate().skip(1) {
        // A second section without a parent comes of a gap above the base: it hangs on the first.
        let parent = if section.parent == NONE { 0 } else { section.parent };
        children[parent as usize].push(place as u32);
    }
    children
}

/// The longest way from each section to a tip, m.
fn lengths_ahead(grown: &Grown) -> Vec<f64> {
    let mut ahead = vec![0.0f64; grown.sections.len()];
    for place in (1..grown.sections.len()).rev() {
        let section = &grown.sections[place];
        let parent = if section.parent == NONE { 0 } else { section.parent as usize };
        let step = distance(section.shape.centre, grown.sections[parent].shape.centre);
        ahead[parent] = ahead[parent].max(ahead[place] + step);
    }
    ahead
}

fn goes_on(grown: &Grown, children: &[u32], at: u32, ahead: &[f64]) -> Option<u32> {
    let own = &grown.sections[at as usize].shape;
    let worth = |child: u32| {
        let shape = &grown.sections[child as usize].shape;
        let step = distance(shape.centre, own.centre);
        (ahead[child as usize] + step) * (1.5 + dot(shape.along, own.along))
    };
    let mut best: Option<(f64, u32)> = None;
    for &child in children {
        let worth = worth(child);
        let points = |section: u32| grown.members(section as usize).len();
        let better = best.is_none_or(|(most, other)| {
            worth > most || (worth == most && points(child) > points(other))
        });
        if better {
            best = Some((worth, child));
        }
    }
    best.map(|(_, child)| child)
}

/// Which branches are kept: tips inwards, a branch goes when what it explains is not worth it, and
/// its points go to the branch it left.
pub(crate) fn prune(
    branches: &mut [Branch],
    grown: &Grown,
    cloud: &Cloud,
    spacing_m: &[f64],
    detail: f64,
) -> Vec<bool> {
    let mut kept = vec![true; branches.len()];
    let mut carries = vec![false; branches.len()];
    for own in (1..branches.len()).rev() {
        let (parent, fork) = (branches[own].parent as usize, branches[own].fork);
        let points = all_points(&branches[own], grown);
        let worth = explained(&points, &branches[parent], fork, grown, cloud, spacing_m);
        let enough = points.len() as f64 >= FEWEST_POINTS / detail;
        kept[own] = carries[own] || (enough && worth >= EXPLAINED_SPACINGS / detail);
        if kept[own] {
            carries[parent] = true;
        } else {
            branches[own].absorbed.clear();
            branches[parent].absorbed.extend(points.into_iter().map(|point| (fork, point)));
        }
    }
    kept
}

fn all_points(branch: &Branch, grown: &Grown) -> Vec<u32> {
    let own = branch.sections.iter().flat_map(|&section| grown.members(section as usize));
    own.copied().chain(branch.absorbed.iter().map(|entry| entry.1)).collect()
}

/// Distances of points from the surface of the branch that would be left, in spacings, added up;
/// points on leaves count less.
fn explained(
    points: &[u32],
    parent: &Branch,
    fork: u32,
    grown: &Grown,
    cloud: &Cloud,
    spacing_m: &[f64],
) -> f64 {
    let from = (fork as usize).saturating_sub(AROUND_FORK);
    let upto = (fork as usize + AROUND_FORK + 1).min(parent.sections.len());
    let axis: Vec<Vector> = parent.sections[from..upto]
        .iter()
        .map(|&section| grown.sections[section as usize].shape.centre)
        .collect();
    let radius = grown.sections[parent.sections[fork as usize] as usize].shape.radius;
    let worth = |&point: &u32| {
        let p = cloud.points[point as usize];
        let away = nearest_on(&axis, p);
        let wood = 0.25 + 0.75 * f64::from(cloud.wood[point as usize]);
        wood * (away - radius).max(0.0) / spacing_m[point as usize].max(1e-6)
    };
    points.iter().map(worth).sum()
}

/// Distance to a line of positions.
fn nearest_on(axis: &[Vector], p: Vector) -> f64 {
    let first = distance(axis[0], p);
    axis.windows(2).map(|pair| to_segment(p, pair[0], pair[1]).0).fold(first, f64::min)
}
