//! Treetops of a tile: candidates for trees. Raise the version when the fields or their meaning
//! change.
//!
//! * Version 2: the score of each, and what hangs over it.
//! * Version 1 (`v1.rs`) is read and migrated.

mod v1;

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
    /// Width of the window in which it is the highest (of the points not far above it), metres.
    pub window_m: f64,
    /// How far it rises above the saddle to anything higher, metres; NaN where that was not asked.
    pub prominence_m: f64,
    /// How sure it is that this is the top of a tree, 0 to 1, by the points around it.
    pub score: f32,
    /// Height of what hangs over it, metres above it; 0 where nothing does.
    pub cover_m: f32,
}

table_kind!(Treetops, "treetops", 2, "candidates for trees of a tile", 1 => v1::Treetops);
