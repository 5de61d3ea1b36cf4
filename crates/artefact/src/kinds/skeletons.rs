//! Skeletons of one tree. Raise the version when the fields or their meaning change.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// The skeletons of one tree: one from the points as scanned and, where there are any, one from the
/// consolidated points. The cylinder fit decides between them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Skeletons {
    /// From the points as scanned.
    pub raw: Skeleton,
    /// From the consolidated points.
    pub consolidated: Option<Skeleton>,
}

/// A tree of nodes; the first is the root, and every node comes after its parent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Skeleton {
    /// The nodes.
    pub nodes: Vec<SkeletonNode>,
}

/// One node.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SkeletonNode {
    /// Position in the frame of the header, m.
    pub position_m: [f64; 3],
    /// Place of the parent in [`Skeleton::nodes`]; none for the root.
    pub parent: Option<u32>,
    /// Radius of the branch below the node by the allometric rule, m.
    pub radius_m: f64,
    /// Number of points that are nearest to the branch below the node.
    pub points: u32,
}

table_kind!(Skeletons, "skeletons", 1, "the branching skeletons of one tree");
