//! A skeleton taken apart into branches.

use crate::points::rounded;
use crate::{Error, SkeletonNode};
use std::collections::VecDeque;
use timberline_solids::vector::{along, distance, dot, sub, unit};

/// Where a branch begins on another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fork {
    /// Place of the other branch.
    pub branch: u32,
    /// How far along that branch, m.
    pub at_m: f64,
}

/// A branch as a line with a radius.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// The axis; that of a side branch begins on the axis of the branch it grows on. At least two
    /// positions.
    pub path_m: Vec<[f64; 3]>,
    /// Radius of each segment of the axis, m.
    pub radius_m: Vec<f64>,
    /// Where it begins; none for the stem.
    pub fork: Option<Fork>,
    /// 0 for the stem, 1 for branches on the stem, and so on.
    pub order: u16,
    /// How far along it leaves the wood of the branch it grows on, m.
    pub begin_m: f64,
}

impl Branch {
    /// How far along the branch each position of its path is, m.
    #[must_use]
    pub fn stations_m(&self) -> Vec<f64> {
        let mut stations = vec![0.0];
        for pair in self.path_m.windows(2) {
            stations.push(stations[stations.len() - 1] + distance(pair[0], pair[1]));
        }
        stations
    }
}

/// The position at a station of a path; beyond its ends that of the end.
#[must_use]
pub fn position_at(path_m: &[[f64; 3]], stations_m: &[f64], at_m: f64) -> [f64; 3] {
    let place = stations_m.partition_point(|station| *station <= at_m);
    if place == 0 || place == path_m.len() {
        return path_m[place.saturating_sub(1).min(path_m.len() - 1)];
    }
    let (low, high) = (stations_m[place - 1], stations_m[place]);
    let share = (at_m - low) / (high - low);
    along(path_m[place - 1], sub(path_m[place], path_m[place - 1]), share)
}

/// Checks that nodes are finite and come after their parents.
///
/// # Errors
/// [`Error::Node`], [`Error::Parent`], and [`Error::NoSegment`] for fewer than two nodes.
pub fn check(nodes: &[SkeletonNode]) -> Result<(), Error> {
    for (node, SkeletonNode { position_m, parent, radius_m }) in nodes.iter().enumerate() {
        if let Some(value) = position_m.iter().find(|value| !value.is_finite()) {
            return Err(Error::Node { node, field: "position_m", value: *value });
        }
        if !(radius_m.is_finite() && *radius_m >= 0.0) {
            return Err(Error::Node { node, field: "radius_m", value: *radius_m });
        }
        let sound = if node == 0 {
            parent.is_none()
        } else {
            parent.is_some_and(|parent| (parent as usize) < node)
        };
        if !sound {
            return Err(Error::Parent { node, parent: *parent });
        }
    }
    if nodes.len() < 2 { Err(Error::NoSegment { nodes: nodes.len() }) } else { Ok(()) }
}

/// Takes a skeleton apart: at every fork the branch goes on in the child that reaches far and straight
/// on, and others begin. The stem comes first, every branch after the one it grows on.
///
/// # Errors
/// As [`check`], and [`Error::NoSegment`] when all nodes are in one place.
pub fn split(nodes: &[SkeletonNode]) -> Result<Vec<Branch>, Error> {
    check(nodes)?;
    let tree = Tree { nodes, children: children(nodes), reach: reaches(nodes) };
    let mut branches: Vec<Branch> = Vec::new();
    // Where branches begin: the node before, that on its branch, and the branch's own first node.
    let mut waiting = VecDeque::from([(None::<(usize, Fork)>, 0usize)]);
    while let Some((from, first)) = waiting.pop_front() {
        let walk = tree.walk(from.map(|(node, _)| node), first);
        let mut branch = Branch {
            path_m: Vec::new(),
            radius_m: Vec::new(),
            fork: from.map(|(_, fork)| fork),
            order: from.map_or(0, |(_, fork)| branches[fork.branch as usize].order + 1),
            begin_m: 0.0,
        };
        fill(&mut branch, nodes, &walk.path);
        if branch.path_m.len() < 2 {
            // All of it in one place: an empty twig, or no tree.
            if branches.is_empty() {
                return Err(Error::NoSegment { nodes: nodes.len() });
            }
            continue;
        }
        let number = branches.len() as u32;
        branches.push(branch);
        let begins = |(child, node, at_m)| (Some((node, Fork { branch: number, at_m })), child);
        waiting.extend(walk.sides.into_iter().map(begins));
    }
    Ok(branches)
}

/// A skeleton with what is asked of it at forks.
struct Tree<'a> {
    nodes: &'a [SkeletonNode],
    children: Vec<Vec<usize>>,
    reach: Vec<f64>,
}

/// The nodes of a branch, and what leaves it: first node, node it leaves at, how far along that is, m.
struct Walk {
    path: Vec<usize>,
    sides: Vec<(usize, usize, f64)>,
}

impl Tree<'_> {
    /// Follows a branch to its tip.
    fn walk(&self, before: Option<usize>, first: usize) -> Walk {
        let mut walk =
            Walk { path: before.into_iter().chain([first]).collect(), sides: Vec::new() };
        let mut length = 0.0;
        let (mut before, mut node) = (before, first);
        loop {
            if let Some(before) = before {
                length += distance(self.nodes[before].position_m, self.nodes[node].position_m);
            }
            let children = &self.children[node];
            let Some(next) = goes_on(self.nodes, children, &self.reach, before, node) else {
                return walk;
            };
            let others = children.iter().filter(|child| **child != next);
            walk.sides.extend(others.map(|child| (*child, node, length)));
            walk.path.push(next);
            (before, node) = (Some(node), next);
        }
    }
}

/// Copies the nodes of a path, without those in the place of the one before.
fn fill(branch: &mut Branch, nodes: &[SkeletonNode], path: &[usize]) {
    for &node in path {
        let SkeletonNode { position_m, radius_m, .. } = nodes[node];
        let position_m = rounded(position_m);
        match branch.path_m.last() {
            Some(last) if distance(*last, position_m) <= 0.0 => {}
            Some(_) => {
                branch.path_m.push(position_m);
                branch.radius_m.push(radius_m);
            }
            None => branch.path_m.push(position_m),
        }
    }
}

fn children(nodes: &[SkeletonNode]) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); nodes.len()];
    for (node, parent) in nodes.iter().enumerate().filter_map(|(i, n)| n.parent.map(|p| (i, p))) {
        children[parent as usize].push(node);
    }
    children
}

/// Longest way from the parent of each node through it to a tip, m.
fn reaches(nodes: &[SkeletonNode]) -> Vec<f64> {
    let mut above = vec![0.0f64; nodes.len()];
    let mut reach = vec![0.0f64; nodes.len()];
    for (node, SkeletonNode { position_m, parent, .. }) in nodes.iter().enumerate().rev() {
        let Some(parent) = parent.map(|parent| parent as usize) else { continue };
        reach[node] = above[node] + distance(*position_m, nodes[parent].position_m);
        above[parent] = above[parent].max(reach[node]);
    }
    reach
}

/// The child in which a branch goes on: far-reaching and straight on. Of equal ones the first.
fn goes_on(
    nodes: &[SkeletonNode],
    children: &[usize],
    reach: &[f64],
    before: Option<usize>,
    node: usize,
) -> Option<usize> {
    // A turn by 90 degrees costs 60 % of the reach, one by 180 degrees 80 %.
    const STRAIGHT: f64 = 1.5;
    let here = nodes[node].position_m;
    let incoming = before.and_then(|before| unit(sub(here, nodes[before].position_m)));
    let score = |child: usize| {
        let outgoing = unit(sub(nodes[child].position_m, here));
        let cos = incoming.zip(outgoing).map_or(0.0, |(a, b)| dot(a, b));
        reach[child] * (STRAIGHT + cos)
    };
    let mut best: Option<(f64, usize)> = None;
    for &child in children {
        let score = score(child);
        if best.is_none_or(|(most, _)| score > most) {
            best = Some((score, child));
        }
    }
    best.map(|(_, child)| child)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(position_m: [f64; 3], parent: Option<u32>) -> SkeletonNode {
        SkeletonNode { position_m, parent, radius_m: 0.1 }
    }

    #[test]
    fn a_branch_goes_on_straight_and_far() {
        let nodes = [
            node([0.0; 3], None),
            node([0.0, 0.0, 2.0], Some(0)),
            node([2.5, 0.0, 2.0], Some(1)),
            node([0.0, 0.0, 4.0], Some(1)),
            node([0.5, 0.0, 4.5], Some(3)),
            node([0.0, 0.0, 6.0], Some(3)),
        ];
        let branches = split(&nodes).unwrap();
        assert_eq!(branches.len(), 3);
        assert_eq!(branches[0].path_m.last(), Some(&[0.0, 0.0, 6.0]));
        assert_eq!(branches[1].path_m, [[0.0, 0.0, 2.0], [2.5, 0.0, 2.0]]);
        assert_eq!(branches[1].fork, Some(Fork { branch: 0, at_m: 2.0 }));
        assert_eq!(branches[2].fork, Some(Fork { branch: 0, at_m: 4.0 }));
        assert_eq!(branches.iter().map(|b| b.order).collect::<Vec<_>>(), [0, 1, 1]);
    }

    #[test]
    fn nodes_in_one_place_make_no_segment() {
        let same = [node([1.0; 3], None), node([1.0; 3], Some(0)), node([1.0; 3], Some(1))];
        assert_eq!(split(&same), Err(Error::NoSegment { nodes: 3 }));
        assert_eq!(split(&same[..1]), Err(Error::NoSegment { nodes: 1 }));
        let twice = [node([0.0; 3], None), node([0.0; 3], Some(0)), node([0.0, 0.0, 1.0], Some(1))];
        assert_eq!(split(&twice).unwrap()[0].path_m.len(), 2);
    }

    #[test]
    fn faults_are_named() {
        let nan = [node([0.0; 3], None), node([0.0, f64::NAN, 1.0], Some(0))];
        let text = split(&nan).unwrap_err().to_string();
        assert_eq!(text, "node 1 of the skeleton has position_m NaN, must be finite");
        let ahead = [node([0.0; 3], None), node([0.0, 0.0, 1.0], Some(2))];
        assert!(split(&ahead).unwrap_err().to_string().contains("parent Some(2)"));
        let second = [node([0.0; 3], None), node([0.0, 0.0, 1.0], None)];
        assert!(matches!(split(&second), Err(Error::Parent { node: 1, parent: None })));
    }

    #[test]
    fn the_last_bits_do_not_matter() {
        let path = |x: f64| {
            let nodes = [node([x, 0.0, 0.0], None), node([x, 0.0, 1.0], Some(0))];
            split(&nodes).unwrap()[0].path_m.clone()
        };
        assert_eq!(path(0.1), path(0.1 + 1e-9));
    }

    #[test]
    fn positions_along_a_path() {
        let path = [[0.0; 3], [0.0, 0.0, 1.0], [1.0, 0.0, 1.0]];
        let at = |at_m: f64| position_at(&path, &[0.0, 1.0, 2.0], at_m);
        assert_eq!(at(-1.0), [0.0; 3]);
        assert_eq!(at(0.5), [0.0, 0.0, 0.5]);
        assert_eq!(at(1.25), [0.25, 0.0, 1.0]);
        assert_eq!(at(9.0), [1.0, 0.0, 1.0]);
    }
}
