//! Treetops of a tile. Raise the version when the fields or their meaning change.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// Treetops whose apex lies in the tile, sorted by id.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Treetops {
    /// The treetops.
    pub tops: Vec<Treetop>,
}

/// One treetop.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Treetop {
    /// Tree id, see [`crate::tree_id()`].
    pub id: u64,
    /// Index of the apex point in its tile.
    pub point: u32,
    /// World position of the apex, metres.
    pub apex_m: [f64; 3],
    /// Height of the apex above ground, metres.
    pub height_m: f64,
    /// Width of the window in which it is the highest, metres.
    pub window_m: f64,
    /// How far it rises above the saddle or the window's mean, metres; see the stage.
    pub prominence_m: f64,
}

table_kind!(Treetops, "treetops", 1, "local maxima of a tile");
