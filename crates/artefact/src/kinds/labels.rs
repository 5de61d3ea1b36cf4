//! The tree of every point of a tile. Raise the version when the meaning of the values changes.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// Tree of every point of a tile, in the tile's order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Labels {
    /// Tree ids; 0 for no tree.
    pub tree_id: Vec<u64>,
    /// How sure the segmenter is, 0 to 1; above [`Labels::ON_SURFACE`] for points on the crown's
    /// surface, 0 for no tree.
    pub score: Vec<f32>,
}

impl Labels {
    /// Score above which a point is on the surface of its tree's crown.
    pub const ON_SURFACE: f32 = 0.5;
}

table_kind!(Labels, "labels", 1, "the tree of every point of a tile");
