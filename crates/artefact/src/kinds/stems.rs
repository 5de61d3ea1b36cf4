//! The trees of a terrestrial campaign: where their stems stand and which voxels are theirs. Raise
//! the version when the fields or their meaning change, also those of [`Stem`].

use super::table_kind;
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Bounds3;

/// All trees of a campaign, sorted by id, and their space.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Stems {
    /// The trees.
    pub stems: Vec<Stem>,
    /// Edge of the voxels, m; voxel `[i, j, k]` begins at `[i, j, k] * voxel_m` in the world.
    pub voxel_m: f64,
    /// The voxels of trees, sorted by column and bottom.
    pub runs: Vec<VoxelRun>,
}

/// What the elevation of a tree's base was taken from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub enum BaseSource {
    /// The terrain.
    #[default]
    Ground,
    /// The tree's lowest points: there is no ground in the scan.
    LowestPoints,
}

impl BaseSource {
    /// The name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ground => "ground",
            Self::LowestPoints => "lowest-points",
        }
    }
}

/// One tree, before it is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stem {
    /// Made from the position of the base, see [`crate::tree_id()`].
    pub tree_id: u64,
    /// Where the stem's axis meets the ground, world, m.
    pub base_m: [f64; 3],
    /// What the elevation of the base was taken from.
    pub base_source: BaseSource,
    /// Diameter at breast height from the slices that found the stem, m; NaN where none was usable.
    pub dbh_m: f64,
    /// World bounds of the tree's voxels, m.
    pub bounds: Bounds3,
}

/// Voxels one above the other that belong to one tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct VoxelRun {
    /// Horizontal index of the voxels.
    pub column: [i32; 2],
    /// Vertical index of the lowest.
    pub bottom: i32,
    /// How many there are.
    pub len: u32,
    /// Place of the tree in [`Stems::stems`].
    pub stem: u32,
}

table_kind!(Stems, "stems", 1, "the stems of a terrestrial campaign and the space of each tree");
