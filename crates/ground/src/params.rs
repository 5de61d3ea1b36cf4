//! Parameters of the two stages.

use crate::quadtree::Division;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the kernel of the terrain model is set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Tuning {
    /// Offset and smoothing are chosen from the points by their leave-one-out errors.
    Auto,
    /// `offset_m` and `smoothing_m` hold everywhere.
    Given,
}

/// Where ground points come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The supplier's class 2 in blocks where it covers the area, classification in the others.
    Auto,
    /// The supplier's class 2.
    Use,
    /// Classification, whatever the supplier's classes.
    Classify,
}

/// Which returns may be ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Returns {
    /// Last returns; a return number of 0 (not recorded) counts as last.
    Last,
    /// Every return.
    All,
}

/// Parameters of the ground classification.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct GroundParams {
    /// Where ground points come from.
    pub source: Source,
    /// Which returns may be ground.
    pub returns: Returns,
    /// Edge of the world-fixed blocks that are classified one by one.
    pub block_m: f64,
    /// How far beyond a block points are considered.
    pub buffer_m: f64,
    /// Edge of the cells whose lowest points are the first ground.
    pub seed_cell_m: f64,
    /// Largest distance from a triangle at the coarsest level.
    pub coarse_distance_m: f64,
    /// Largest distance from a triangle at the finest level.
    pub fine_distance_m: f64,
    /// Largest angle at the coarsest level.
    pub coarse_angle_deg: f64,
    /// Largest angle at the finest level.
    pub fine_angle_deg: f64,
    /// Slope to all neighbours above which a ground vertex is taken back.
    pub spike_deg: f64,
    /// Height above the neighbours' plane from which a vertex is trimmed at the end.
    pub trim_m: f64,
    /// What is added to it per metre of distance of the neighbours.
    pub trim_slope: f64,
    /// Distance from the final triangulation within which points are ground.
    pub tolerance_m: f64,
}

impl Default for GroundParams {
    fn default() -> Self {
        Self {
            source: Source::Auto,
            returns: Returns::Last,
            block_m: 64.0,
            buffer_m: 24.0,
            seed_cell_m: 32.0,
            coarse_distance_m: 6.0,
            fine_distance_m: 0.3,
            coarse_angle_deg: 30.0,
            fine_angle_deg: 15.0,
            spike_deg: 25.0,
            trim_m: 0.12,
            trim_slope: 0.08,
            tolerance_m: 0.08,
        }
    }
}

/// Parameters of the terrain model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DtmParams {
    /// How the kernel is set.
    #[schemars(extend("x-source" = "Rippa 1999"))]
    pub tuning: Tuning,
    /// Kernel offset D where `tuning` is `given`.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "Hardy 1971"))]
    pub offset_m: f64,
    /// Smoothing λ where `tuning` is `given`; 0 passes through every ground point.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "Hardy 1971"))]
    pub smoothing_m: f64,
    /// Where `tuning` is `auto`: how many points' worth of belief the usual kernel starts with.
    #[schemars(range(min = 0.0, max = 10_000.0), extend("x-unit" = "points", "x-source" = "measured"))]
    pub prior_weight: f64,
    /// Ground points above which a patch is divided into four.
    #[schemars(range(min = 24, max = 1000), extend("x-unit" = "points", "x-source" = "measured"))]
    pub most_nodes: usize,
    /// Edge of the largest patches, as a power of two.
    #[schemars(range(min = 2, max = 7), extend("x-unit" = "log2 m", "x-source" = "measured"))]
    pub log2_root: i32,
    /// Ground points closer together than this become one node at their mean.
    #[schemars(range(min = 0.0, max = 5.0), extend("x-unit" = "m", "x-source" = "measured"))]
    pub merge_m: f64,
    /// Edge of the raster's cells.
    #[schemars(range(min = 0.1, max = 50.0), extend("x-unit" = "m", "x-source" = "convention"))]
    pub cell_m: f64,
    /// How far from the nearest point of any class the raster goes on.
    #[schemars(range(min = 0.0, max = 30.0), extend("x-unit" = "m", "x-source" = "convention"))]
    pub rim_m: f64,
}

impl Default for DtmParams {
    fn default() -> Self {
        Self {
            tuning: Tuning::Auto,
            offset_m: 0.5,
            smoothing_m: 0.03,
            prior_weight: 10.0,
            most_nodes: 120,
            log2_root: 4,
            merge_m: 0.1,
            cell_m: 0.5,
            rim_m: 5.0,
        }
    }
}

impl DtmParams {
    /// The rule by which squares are divided.
    #[must_use]
    pub fn division(&self) -> Division {
        Division { log2_root: self.log2_root, log2_smallest: -1, most_nodes: self.most_nodes }
    }

    /// How far beyond a square its patch may look for nodes, metres.
    #[must_use]
    pub fn gather_m(&self) -> f64 {
        2.0 * crate::nodes::edge_m(self.log2_root)
    }

    /// How far beyond a rectangle ground points have a say in the surface over it, metres: the
    /// largest square whose weight reaches in, the squares around it that have a say in its kernel,
    /// and how far these look for nodes.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        2.0 * crate::nodes::edge_m(self.log2_root) + self.gather_m()
    }
}
