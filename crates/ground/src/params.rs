//! Parameters of the two stages.

use crate::nodes::edge_m;
use crate::quadtree::{BLEND_MARGIN, Division};
use crate::surface::BUCKET_M;
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
    #[schemars(extend("x-source" = "Axelsson 2000"))]
    pub returns: Returns,
    /// Of dense clouds only one point in every square cell of this edge is looked at, one of the lowest;
    /// 0 looks at all.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "m", "x-source" = "finer than the relief of forest soil: 0.25 m for terrestrial scans"))]
    pub thin_m: f64,
    /// Edge of the world-fixed blocks that are classified one by one, in whole metres.
    #[schemars(range(min = 16.0, max = 512.0), extend("x-unit" = "m"))]
    pub block_m: f64,
    /// How far beyond a block points are considered, in whole metres.
    #[schemars(range(min = 4.0, max = 256.0), extend("x-unit" = "m"))]
    pub buffer_m: f64,
    /// Edge of the cells whose lowest points are the first ground; wider than any building or
    /// stretch of canopy without a return from the ground.
    #[schemars(range(min = 2.0, max = 256.0), extend("x-unit" = "m", "x-source" = "Axelsson 2000"))]
    pub seed_cell_m: f64,
    /// Largest distance from a triangle of the coarsest triangulation.
    #[schemars(range(min = 0.1, max = 50.0), extend("x-unit" = "m", "x-source" = "form: Axelsson 2000; value: measured on steep forest"))]
    pub coarse_distance_m: f64,
    /// Largest distance from a triangle of the finest triangulation.
    #[schemars(range(min = 0.01, max = 5.0), extend("x-unit" = "m", "x-source" = "form: Axelsson 2000; value: measured on steep forest"))]
    pub fine_distance_m: f64,
    /// Largest angle to a triangle's corner in the coarsest triangulation.
    #[schemars(range(min = 1.0, max = 89.0), extend("x-unit" = "deg", "x-source" = "form: Axelsson 2000; value: measured on steep forest"))]
    pub coarse_angle_deg: f64,
    /// Largest angle to a triangle's corner in the finest triangulation.
    #[schemars(range(min = 1.0, max = 89.0), extend("x-unit" = "deg", "x-source" = "form: Axelsson 2000; value: measured on steep forest"))]
    pub fine_angle_deg: f64,
    /// Slope against the plane of all neighbours above which a ground vertex is taken back.
    #[schemars(range(min = 5.0, max = 89.0), extend("x-unit" = "deg", "x-source" = "measured on steep forest"))]
    pub spike_deg: f64,
    /// Height above the plane of the neighbours from which a vertex is trimmed as low vegetation.
    #[schemars(range(min = 0.0, max = 5.0), extend("x-unit" = "m", "x-source" = "measured on real scans"))]
    pub trim_m: f64,
    /// What is added to it per metre of distance of the neighbours.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m/m", "x-source" = "measured on real scans"))]
    pub trim_slope: f64,
    /// Distance above the final triangulation within which points are ground; twice that below it.
    #[schemars(range(min = 0.001, max = 1.0), extend("x-unit" = "m", "x-source" = "ranging noise of airborne scanners"))]
    pub tolerance_m: f64,
}

impl Default for GroundParams {
    fn default() -> Self {
        Self {
            source: Source::Auto,
            returns: Returns::Last,
            thin_m: 0.0,
            block_m: 64.0,
            buffer_m: 24.0,
            seed_cell_m: 32.0,
            coarse_distance_m: 6.0,
            fine_distance_m: 0.3,
            coarse_angle_deg: 30.0,
            fine_angle_deg: 15.0,
            spike_deg: 20.0,
            trim_m: 0.08,
            trim_slope: 0.08,
            tolerance_m: 0.08,
        }
    }
}

impl GroundParams {
    /// What is wrong across fields, one sentence each; empty when nothing is.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        for (name, value) in [("block_m", self.block_m), ("buffer_m", self.buffer_m)] {
            if !(value >= 1.0 && value.fract() == 0.0) {
                wrong.push(format!("`{name}` is {value}, must be whole metres, at least 1"));
            }
        }
        if self.fine_distance_m > self.coarse_distance_m {
            wrong.push(format!(
                "`fine_distance_m` is {}, above `coarse_distance_m` of {}",
                self.fine_distance_m, self.coarse_distance_m
            ));
        }
        wrong
    }

    /// How far beyond any rectangle points decide about its points, metres.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        self.block_m + self.buffer_m
    }
}

/// Parameters of the terrain model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DtmParams {
    /// How the kernel is set.
    #[schemars(extend("x-source" = "Rippa 1999"))]
    pub tuning: Tuning,
    /// Kernel offset D where `tuning` is `given`; 0 is the cone of Tittmann et al. 2011.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "Hardy 1971"))]
    pub offset_m: f64,
    /// Smoothing λ where `tuning` is `given`; 0 passes through every ground point.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "Hardy 1971"))]
    pub smoothing_m: f64,
    /// Where `tuning` is `auto`: how strongly the kernel that is best on average is preferred, in
    /// units of twice the log-likelihood per step between candidates.
    #[schemars(range(min = 0.0, max = 10_000.0), extend("x-source" = "measured by cross-validation on real scans"))]
    pub prior_weight: f64,
    /// Ground points in the neighbourhood of a patch above which it is divided into four.
    #[schemars(range(min = 24, max = 1000), extend("x-unit" = "points", "x-source" = "measured by cross-validation on real scans"))]
    pub most_nodes: u32,
    /// Edge of the largest patches, a power of two.
    #[schemars(range(min = 4.0, max = 128.0), extend("x-unit" = "m", "x-source" = "measured by cross-validation on real scans"))]
    pub largest_patch_m: f64,
    /// Ground points in one world-fixed square of this edge become one node at their mean; 0 merges
    /// only points of equal x and y.
    #[schemars(range(min = 0.0, max = 5.0), extend("x-unit" = "m"))]
    pub merge_m: f64,
    /// Distance from ground points beyond which there is no terrain (in squares of 2 m).
    #[schemars(range(min = 1.0, max = 128.0), extend("x-unit" = "m"))]
    pub max_distance_m: f64,
    /// Edge of the raster's cells.
    #[schemars(range(min = 0.1, max = 50.0), extend("x-unit" = "m"))]
    pub cell_m: f64,
    /// Widest gap in the points of any class across which the raster goes on; it ends with them.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-unit" = "m", "x-source" = "morphological closing, Serra 1982"))]
    pub gap_m: f64,
}

impl Default for DtmParams {
    fn default() -> Self {
        Self {
            tuning: Tuning::Auto,
            offset_m: 0.5,
            smoothing_m: 0.03,
            prior_weight: 40.0,
            most_nodes: 120,
            largest_patch_m: 16.0,
            merge_m: 0.1,
            max_distance_m: 30.0,
            cell_m: 0.5,
            gap_m: 30.0,
        }
    }
}

/// log2 of the edge of the smallest patches, 0.5 m: a run of the world's curve, as any square from
/// the curve's own cell up.
const LOG2_SMALLEST: i32 = -1;

impl DtmParams {
    /// What is wrong across fields, one sentence each; empty when nothing is.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        if edge_m(self.log2_root()) != self.largest_patch_m {
            wrong.push(format!(
                "`largest_patch_m` is {}, must be a power of two",
                self.largest_patch_m
            ));
        }
        if self.max_distance_m > self.gather_m() {
            wrong.push(format!(
                "`max_distance_m` is {}, above {} m, the farthest a patch looks for ground with \
                 `largest_patch_m` of {}",
                self.max_distance_m,
                self.gather_m(),
                self.largest_patch_m
            ));
        }
        wrong
    }

    /// The rule by which squares are divided.
    #[must_use]
    pub fn division(&self) -> Division {
        let most_nodes = self.most_nodes as usize;
        Division { log2_root: self.log2_root(), log2_smallest: LOG2_SMALLEST, most_nodes }
    }

    /// How far beyond its square a patch may look for nodes, metres.
    #[must_use]
    pub fn gather_m(&self) -> f64 {
        2.0 * self.largest_patch_m
    }

    /// Half the side of the square that closes gaps in the raster, cells.
    #[must_use]
    pub fn gap_cells(&self) -> u32 {
        (self.gap_m / 2.0 / self.cell_m).ceil() as u32
    }

    /// How far beyond a rectangle points have a say in the terrain over it, metres. In the surface:
    /// the bucket, the largest square whose weight reaches in, and how far that looks for nodes (the
    /// squares around it that have a say in its kernel look less far). In where the raster shows it:
    /// the closing's two squares and the cell of the border.
    #[must_use]
    pub fn reach_m(&self) -> f64 {
        let surface = BUCKET_M + (BLEND_MARGIN + 1.0) * self.largest_patch_m + self.gather_m();
        surface.max(f64::from(2 * self.gap_cells() + 1) * self.cell_m)
    }

    fn log2_root(&self) -> i32 {
        libm::log2(self.largest_patch_m).round() as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_sound() {
        assert_eq!(GroundParams::default().check(), Vec::<String>::new());
        assert_eq!(DtmParams::default().check(), Vec::<String>::new());
    }

    #[test]
    fn the_reach_holds_surface_and_gaps() {
        assert_eq!(DtmParams::default().reach_m(), 54.0);
        let wide = DtmParams { gap_m: 80.0, ..DtmParams::default() };
        assert_eq!(wide.reach_m(), 80.5);
    }

    #[test]
    fn faults_are_named_with_their_value() {
        let ground = GroundParams { block_m: 10.5, fine_distance_m: 9.0, ..Default::default() };
        let wrong = ground.check().join("; ");
        assert!(wrong.contains("`block_m` is 10.5") && wrong.contains("`fine_distance_m` is 9"));
        let dtm = DtmParams { largest_patch_m: 12.0, max_distance_m: 90.0, ..Default::default() };
        let wrong = dtm.check().join("; ");
        assert!(wrong.contains("`largest_patch_m` is 12") && wrong.contains("is 90, above 24 m"));
    }
}
