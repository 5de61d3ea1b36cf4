//! Height above ground of a tile's points. Raise the version when the meaning of the values changes.

use super::table_kind;
use serde::{Deserialize, Serialize};

/// Height above ground of every point of a tile, in the tile's order.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Heights {
    /// Heights in metres; NaN where there is no ground model.
    pub height_m: Vec<f32>,
}

table_kind!(Heights, "heights", 1, "height above ground of every point of a tile");
