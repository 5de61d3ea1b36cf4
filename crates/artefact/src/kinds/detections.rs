//! Detected trees of a tile. Raise the version when the fields or their meaning change, also those
//! of [`CrownModel`].

use super::{CrownModel, table_kind};
use serde::{Deserialize, Serialize};

/// Trees taken to exist whose apex lies in the tile, sorted by id.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Detections {
    /// The trees.
    pub trees: Vec<Detection>,
}

/// Whether something hangs over a tree's top.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub enum Origin {
    /// Nothing does.
    #[default]
    Surface,
    /// Points further above it than its own crown can reach (`candidate_gap_m` of `treetops`).
    BelowCanopy,
}

impl Origin {
    /// The name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Surface => "surface",
            Self::BelowCanopy => "below-canopy",
        }
    }
}

/// One tree.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Detection {
    /// Apex, height and crown model; its status says whether the model stands.
    pub model: CrownModel,
    /// How sure it is that this is a tree, 0 to 1.
    pub score: f32,
    /// Whether something hangs over its top.
    pub origin: Origin,
}

table_kind!(Detections, "detections", 1, "the trees of a tile, chosen among the candidates");
