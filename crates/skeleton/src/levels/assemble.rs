//! Branches made into nodes.

use super::axis::{even_out, simplify, smooth};
use super::branches::Branch;
use super::grow::Grown;
use super::section::Shape;
use crate::cloud::Cloud;
use crate::model::{Node, Skeleton};
use crate::paths::NONE;
use crate::radii::{Seen, allometric_radii};
use crate::vector::{Vector, add, dot, scale, sub, unit};
use crate::{SkeletonParams, base};

/// Most of the tree's height by which the stem is drawn out to a base below its lowest points.
const DRAWN_OUT: f64 = 0.2;

/// A branch on its way to nodes: its first position is on the branch it leaves (of the stem: its
/// foot), then come the sections' centres, then its tip.
struct Line {
    at: Vec<Vector>,
    shapes: Vec<Shape>,
    /// Points of each section, with those of branches that were not kept.
    points: Vec<u32>,
    /// Sections that other branches leave from.
    forks: Vec<bool>,
    has_tip: bool,
}

/// Nodes so far, and where sections are among them.
#[derive(Default)]
struct Made {
    nodes: Vec<Node>,
    /// Node of every section that a branch leaves from.
    of_section: Vec<u32>,
    /// Circles that were seen.
    seen: Vec<Seen>,
}

/// Makes the skeleton of the branches that are kept.
pub(crate) fn assemble(
    cloud: &Cloud,
    grown: &Grown,
    branches: &[Branch],
    kept: &[bool],
    base_m: Option<Vector>,
    params: &SkeletonParams,
) -> Skeleton {
    let mut forks = vec![false; grown.sections.len()];
    for (branch, _) in branches.iter().zip(kept).skip(1).filter(|(_, kept)| **kept) {
        forks[fork_of(branches, branch) as usize] = true;
    }
    let mut made = Made { of_section: vec![NONE; grown.sections.len()], ..Made::default() };
    for (branch, _) in branches.iter().zip(kept).filter(|(_, kept)| **kept) {
        let from = (branch.parent != NONE).then(|| {
            let node = made.of_section[fork_of(branches, branch) as usize];
            (node, made.nodes[node as usize].position_m)
        });
        let mut line = line(cloud, grown, branch, &forks, from.map(|from| from.1), base_m);
        smooth(&mut line.at, params.smoothing);
        put(&mut made, &line, branch, from.map(|from| from.0), params.simplify);
    }
    allometric_radii(&mut made.nodes, &made.seen, fallback_radius(cloud));
    for node in &mut made.nodes {
        node.position_m = cloud.to_given(node.position_m);
    }
    Skeleton { nodes: made.nodes }
}

fn fork_of(branches: &[Branch], branch: &Branch) -> u32 {
    branches[branch.parent as usize].sections[branch.fork as usize]
}

/// The first radius as AdTree takes it, where no circle was seen.
fn fallback_radius(cloud: &Cloud) -> f64 {
    base::first_radius_m(&cloud.points, &base::lowest(&cloud.points)).max(1e-3)
}

fn line(
    cloud: &Cloud,
    grown: &Grown,
    branch: &Branch,
    forks: &[bool],
    from: Option<Vector>,
    base_m: Option<Vector>,
) -> Line {
    let section = |&s: &u32| &grown.sections[s as usize];
    let shapes: Vec<Shape> = branch.sections.iter().map(|s| section(s).shape).collect();
    let centres = even_out(&shapes);
    let count = |&p: &u32| cloud.count[p as usize];
    let mut points: Vec<u32> = branch
        .sections
        .iter()
        .map(|&s| grown.members(s as usize).iter().map(count).sum())
        .collect();
    for (place, point) in &branch.absorbed {
        points[*place as usize] += count(point);
    }
    let first = from.or_else(|| foot(cloud, grown, &centres, base_m)).unwrap_or(centres[0]);
    let tip = tip(cloud, grown, branch, &centres, first);
    let mut at = vec![first];
    at.extend(&centres);
    at.extend(tip);
    let forks = branch.sections.iter().map(|&s| forks[s as usize]).collect();
    Line { at, shapes, points, forks, has_tip: tip.is_some() }
}

/// The foot of the stem: its axis drawn out to the base, or to the height of its lowest points.
fn foot(
    cloud: &Cloud,
    grown: &Grown,
    centres: &[Vector],
    base_m: Option<Vector>,
) -> Option<Vector> {
    let members = grown.members(0).iter().map(|&p| cloud.points[p as usize][2]);
    let lowest = members.fold(f64::INFINITY, f64::min);
    let (low, high) = cloud.heights_m();
    let near = |base: &Vector| (lowest - base[2]).abs() <= DRAWN_OUT * (high - low);
    let to = base_m.filter(near).map_or(lowest, |base| base[2]);
    let above = centres[centres.len().min(4) - 1];
    let along = unit(sub(above, centres[0])).filter(|along| along[2] > 0.5);
    let along = along.unwrap_or([0.0, 0.0, 1.0]);
    let down = (centres[0][2] - to) / along[2];
    (down > 0.0).then(|| sub(centres[0], scale(along, down)))
}

/// Where a branch ends: as far beyond its last centre as its points reach.
fn tip(
    cloud: &Cloud,
    grown: &Grown,
    branch: &Branch,
    centres: &[Vector],
    first: Vector,
) -> Option<Vector> {
    let last = centres[centres.len() - 1];
    let before = centres.len().checked_sub(2).map_or(first, |place| centres[place]);
    let along = unit(sub(last, before))?;
    let section = branch.sections[branch.sections.len() - 1] as usize;
    let ahead = |&p: &u32| dot(sub(cloud.points[p as usize], last), along);
    let most = grown.members(section).iter().map(ahead).fold(0.0, f64::max);
    (most > 1e-4).then(|| add(last, scale(along, most)))
}

/// Adds the nodes of a branch. `from` is the node it leaves from; the stem has none.
fn put(made: &mut Made, line: &Line, branch: &Branch, from: Option<u32>, simplify_by: f64) {
    let len = line.at.len();
    let sections = line.shapes.len();
    let shape = |i: usize| &line.shapes[i.clamp(1, sections) - 1];
    let tolerance: Vec<f64> =
        (0..len).map(|i| simplify_by * shape(i).radius.max(0.25 * shape(i).spacing)).collect();
    let fixed: Vec<bool> =
        (0..len).map(|i| i >= 1 && i <= sections && line.forks[i - 1]).collect();
    let needed = simplify(&line.at, &tolerance, &fixed);
    let mut parent = from;
    let mut points = 0;
    let mut circles = Vec::new();
    for i in 0..len {
        if i >= 1 && i <= sections {
            points += line.points[i - 1];
            if shape(i).round {
                circles.push((shape(i).radius, line.points[i - 1]));
            }
        }
        if !needed[i] || (i == 0 && from.is_some()) {
            continue;
        }
        let own = made.nodes.len() as u32;
        made.seen.extend(circles.drain(..).map(|(radius_m, points)| Seen {
            node: own,
            radius_m,
            points,
        }));
        made.nodes.push(Node { position_m: line.at[i], parent, radius_m: 0.0, points });
        if i >= 1 && i <= sections {
            made.of_section[branch.sections[i - 1] as usize] = own;
        }
        (parent, points) = (Some(own), 0);
    }
    debug_assert!(line.has_tip || needed[sections]);
}
