//! Parameters of the skeleton.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the skeleton is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Sections between level sets of the distance from the base, each with a robust centre.
    Levels,
    /// The steps and constants of AdTree (Du et al. 2019).
    Adtree,
}

/// The tree of edges that AdTree's steps begin with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Tree {
    /// Shortest paths over squared lengths, as AdTree does.
    ShortestPaths,
    /// The minimum spanning tree, as its paper says.
    SpanningTree,
}

/// The graph under AdTree's tree.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Edges {
    /// Delaunay up to `most_delaunay` points, nearest neighbours beyond.
    Auto,
    /// The Delaunay triangulation in space.
    Delaunay,
    /// 32 nearest neighbours and the spanning tree.
    Neighbours,
}

/// Parameters of the skeleton.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SkeletonParams {
    /// How the skeleton is made.
    pub method: Method,
    /// How small a branch may be where `method` is `levels`: half of the default keeps only branches
    /// that explain twice as much, twice of it those that explain half.
    #[schemars(range(min = 0.01, max = 100.0), extend("x-source" = "1: fewest branches that reach the distances of AdTree on public scans, docs/terrestrial.md"))]
    pub detail: f64,
    /// Neighbours of a point in the graph where `method` is `levels`.
    #[schemars(range(min = 4, max = 64), extend("x-unit" = "points"))]
    pub neighbours: u32,
    /// Widest gap that is bridged to a piece of the cloud, which must be at least as large as the
    /// gap is wide. Gaps of a few spacings are always bridged.
    #[schemars(range(min = 0.0, max = 50.0), extend("x-unit" = "m", "x-source" = "measured on public scans of single trees"))]
    pub gap_m: f64,
    /// How far the simplified axis may be from the sections' centres, relative to the radius.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-source" = "measured on public scans of single trees"))]
    pub simplify: f64,
    /// Passes of smoothing along the branches.
    #[schemars(range(min = 0, max = 50), extend("x-source" = "form: Taubin 1995"))]
    pub smoothing: u32,
    /// The tree of edges where `method` is `adtree`.
    #[schemars(extend("x-source" = "Du et al. 2019"))]
    pub tree: Tree,
    /// The graph under that tree.
    pub edges: Edges,
    /// Most points that are triangulated where `edges` is `auto`.
    #[schemars(range(min = 0, max = 10_000_000), extend("x-unit" = "points"))]
    pub most_delaunay: u32,
}

impl Default for SkeletonParams {
    fn default() -> Self {
        Self {
            method: Method::Levels,
            detail: 1.0,
            neighbours: 12,
            gap_m: 1.5,
            simplify: 0.2,
            smoothing: 3,
            tree: Tree::ShortestPaths,
            edges: Edges::Auto,
            most_delaunay: 200_000,
        }
    }
}

impl SkeletonParams {
    /// What is wrong across fields, one sentence each; empty when nothing is.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        let ranges = [
            ("detail", self.detail, 0.01, 100.0),
            ("gap_m", self.gap_m, 0.0, 50.0),
            ("simplify", self.simplify, 0.0, 2.0),
            ("neighbours", f64::from(self.neighbours), 4.0, 64.0),
        ];
        for (name, value, least, most) in ranges {
            if !(value >= least && value <= most) {
                wrong.push(format!("`{name}` is {value}, must be from {least} to {most}"));
            }
        }
        wrong
    }
}
