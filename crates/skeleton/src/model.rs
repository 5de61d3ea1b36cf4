//! What comes out: a tree of nodes, and what was done to the points on the way.

use serde::{Deserialize, Serialize};

/// One node of a skeleton.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Position in the frame of the points, m.
    pub position_m: [f64; 3],
    /// Place of the parent in [`Skeleton::nodes`]; none for the root, which is the first.
    pub parent: Option<u32>,
    /// Radius of the branch between this node and its parent by the allometric rule of the method,
    /// m; at the root, that of its first child.
    pub radius_m: f64,
    /// Number of points that are nearest to the branch between this node and its parent.
    pub points: u32,
}

/// A tree of nodes. Every node comes after its parent. Of the children of a node the first in the
/// list continues its branch, every other begins a branch of its own.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Skeleton {
    /// The nodes; the first is the root.
    pub nodes: Vec<Node>,
}

impl Skeleton {
    /// The children of every node, in their order.
    #[must_use]
    pub fn children(&self) -> Vec<Vec<u32>> {
        let mut children = vec![Vec::new(); self.nodes.len()];
        for (place, node) in self.nodes.iter().enumerate() {
            if let Some(parent) = node.parent {
                children[parent as usize].push(place as u32);
            }
        }
        children
    }

    /// Number of branches: runs of first children, from the root or from where one leaves another.
    #[must_use]
    pub fn branches(&self) -> usize {
        let tips = self.children().iter().filter(|children| children.is_empty()).count();
        if self.nodes.len() < 2 { 0 } else { tips }
    }

    /// The branches as places of nodes from base to tip. The first node of each but the first
    /// branch is the one on its parent that it leaves from.
    #[must_use]
    pub fn runs(&self) -> Vec<Vec<u32>> {
        let children = self.children();
        let mut runs = Vec::new();
        let mut open: Vec<Vec<u32>> = if self.nodes.is_empty() { vec![] } else { vec![vec![0]] };
        while let Some(mut run) = open.pop() {
            while let Some((&first, others)) =
                run.last().and_then(|&last| children[last as usize].split_first())
            {
                let from = run[run.len() - 1];
                open.extend(others.iter().map(|&other| vec![from, other]));
                run.push(first);
            }
            runs.push(run);
        }
        runs.sort_unstable();
        runs
    }
}

/// The graph that the paths ran over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum GraphKind {
    /// The Delaunay triangulation in space.
    Delaunay,
    /// Nearest neighbours, and the spanning tree where they are not connected.
    Neighbours,
}

/// What was done to the points on the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Points given.
    pub points: u64,
    /// Points left out because a coordinate was no finite number.
    pub not_finite: u64,
    /// Points at a position that another point has.
    pub duplicates: u64,
    /// Points cut off: pieces of the cloud beyond gaps too wide for their size.
    pub cut_off: u64,
    /// Pieces cut off.
    pub pieces_cut_off: u64,
    /// Median distance to the fourth neighbour, m.
    pub spacing_m: f64,
    /// The graph used.
    pub graph: GraphKind,
}

/// A skeleton and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The skeleton, in the frame of the points.
    pub skeleton: Skeleton,
    /// What was done to the points.
    pub report: Report,
}
