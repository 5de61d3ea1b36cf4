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

/// Parameters of the terrain model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DtmParams {
    /// How the kernel is set.
    pub tuning: Tuning,
    /// Kernel offset D where `tuning` is `given`.
    pub offset_m: f64,
    /// Smoothing λ where `tuning` is `given`.
    pub smoothing_m: f64,
    /// dev
    pub prior_weight: f64,
    /// dev
    pub most_nodes: usize,
    /// dev
    pub log2_root: i32,
}

impl Default for DtmParams {
    fn default() -> Self {
        Self { tuning: Tuning::Auto, offset_m: 0.5, smoothing_m: 0.03, prior_weight: 10.0, most_nodes: 120, log2_root: 4 }
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
}
