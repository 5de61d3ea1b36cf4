//! Parameters of the stage.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which points belong to a tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Membership {
    /// Those on the crown's surface (the consensus set, as in Tittmann et al. 2011).
    Surface,
    /// Those on the crown's surface and all below it within the crown radius.
    Volume,
}

/// How points are given their trees. The trees themselves come from the stage `detection`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SegmentMethod {
    /// The crown model on or below whose surface a point lies (Tittmann et al. 2011).
    Starsac,
}

/// Parameters of the stage `segmentation`.
///
/// Those of one method begin with its name; the others hold for several.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SegmentationParams {
    /// How points are given their trees.
    #[schemars(extend("x-source" = "as each method says"))]
    pub method: SegmentMethod,
    /// Edge of the squares in which a method works whose answer depends on more than a point's
    /// surroundings; they are fixed in the world, whole metres.
    #[schemars(range(min = 8, max = 1024), extend("x-unit" = "m", "x-source" = "this program"))]
    pub block_m: u32,
    /// For `starsac`: which points belong to a tree.
    #[schemars(extend("x-source" = "Tittmann et al. 2011, section 3: surface; volume: this program"))]
    pub membership: Membership,
    /// Farthest a crown can reach from its apex; a wider one is an error. Half the diagonal of the
    /// windows of `crown-models` is always enough.
    #[schemars(range(min = 1.0, max = 60.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub reach_m: f64,
    /// Points lower than this above the ground belong to no tree.
    #[schemars(range(min = 0.0, max = 30.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub min_height_m: f64,
    /// With `membership = "volume"`: points up to this far above the surface still belong, for
    /// crowns are rougher than their models.
    #[schemars(range(min = 0.0, max = 20.0), extend("x-unit" = "m", "x-source" = "this program"))]
    pub above_m: f64,
}

impl Default for SegmentationParams {
    fn default() -> Self {
        Self {
            method: SegmentMethod::Starsac,
            block_m: 64,
            membership: Membership::Volume,
            reach_m: 15.0,
            min_height_m: 1.0,
            above_m: 1.5,
        }
    }
}
