//! Which of a tile's points lie on the ground. Raise the version when the fields or their meaning change.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// Ground points of one tile.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GroundPoints {
    /// Indices of the ground points in the tile, ascending.
    pub ground: Vec<u32>,
    /// Whether the supplier's classes were taken (true) or the points were classified (false), for
    /// each entry of `ground`'s block: number of ground points that were supplied.
    pub supplied: u64,
}

table_kind!(GroundPoints, "ground-points", 1, "which of a tile's points lie on the ground");
