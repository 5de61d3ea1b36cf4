//! Parameters of the stages.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How stems are found and voxels are given to them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct StemsParams {
    /// Height above ground at which the search for stems begins.
    #[schemars(range(min = 0.1, max = 5.0), extend("x-unit" = "m", "x-source" = "above most ground vegetation"))]
    pub search_from_m: f64,
    /// Height above ground at which the search for stems ends.
    #[schemars(range(min = 1.0, max = 30.0), extend("x-unit" = "m", "x-source" = "below most crowns"))]
    pub search_to_m: f64,
    /// Thickness of a slice.
    #[schemars(range(min = 0.02, max = 1.0), extend("x-unit" = "m", "x-source" = "a lean of 10 degrees moves a stem by 3 cm over it"))]
    pub slice_m: f64,
    /// From the beginning of a slice to that of the next.
    #[schemars(range(min = 0.02, max = 2.0), extend("x-unit" = "m", "x-source" = "breast height lies in one and touches another"))]
    pub step_m: f64,
    /// Points of a slice closer than this are one cluster.
    #[schemars(range(min = 0.01, max = 0.5), extend("x-unit" = "m", "x-source" = "point spacing on stems at the far end of a scan"))]
    pub cluster_m: f64,
    /// Distance from the circle within which a point supports it: noise of the scanner and bark.
    #[schemars(range(min = 0.002, max = 0.1), extend("x-unit" = "m", "x-source" = "range noise of 2 to 5 mm, bark and ovality of 1 to 2 cm"))]
    pub noise_m: f64,
    /// Smallest diameter of a stem.
    #[schemars(range(min = 0.01, max = 1.0), extend("x-unit" = "m", "x-source" = "below it shrubs look alike"))]
    pub smallest_dbh_m: f64,
    /// Largest diameter of a stem.
    #[schemars(range(min = 0.1, max = 10.0), extend("x-unit" = "m", "x-source" = "few trees are thicker"))]
    pub largest_dbh_m: f64,
    /// Height a stem must be seen over.
    #[schemars(range(min = 0.2, max = 10.0), extend("x-unit" = "m", "x-source" = "longer than what low branches and shrubs show"))]
    pub smallest_span_m: f64,
    /// Lower trees are undergrowth; where no ground is seen, none is too low.
    #[schemars(range(min = 0.0, max = 50.0), extend("x-unit" = "m", "x-source" = "national inventories leave out saplings"))]
    pub smallest_height_m: f64,
    /// Edge of the voxels in which points are given to trees.
    #[schemars(range(min = 0.01, max = 0.5), extend("x-unit" = "m", "x-source" = "finer than the gaps between touching crowns"))]
    pub voxel_m: f64,
    /// Widest gap that a way from a stem to a point may leap.
    #[schemars(range(min = 0.05, max = 5.0), extend("x-unit" = "m", "x-source" = "occluded parts of branches"))]
    pub gap_m: f64,
    /// Points below this height above ground belong to no tree, except on a stem.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "m", "x-source" = "roughness of the ground and of its model"))]
    pub clearance_m: f64,
    /// Exponent of the diameter by which ways are divided.
    #[schemars(range(min = 0.0, max = 2.0), extend("x-unit" = "1", "x-source" = "Tao et al. 2015, comparative shortest paths: 2/3"))]
    pub metabolic_exponent: f64,
    /// A scan has ground if at least this share of its area does, as a surface below all else; otherwise
    /// a tree stands on its lowest points.
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "1", "x-source" = "single trees cut out of a scan have none; under dense crowns half is hidden"))]
    pub ground_share: f64,
}

impl Default for StemsParams {
    fn default() -> Self {
        Self {
            search_from_m: 0.4,
            search_to_m: 6.0,
            slice_m: 0.16,
            step_m: 0.2,
            cluster_m: 0.08,
            noise_m: 0.02,
            smallest_dbh_m: 0.04,
            largest_dbh_m: 2.0,
            smallest_span_m: 1.0,
            smallest_height_m: 3.0,
            voxel_m: 0.05,
            gap_m: 1.0,
            clearance_m: 0.1,
            metabolic_exponent: 2.0 / 3.0,
            ground_share: 0.15,
        }
    }
}

impl StemsParams {
    /// What is wrong with the values together.
    #[must_use]
    pub fn check(&self) -> Vec<String> {
        let mut faults = Vec::new();
        if self.search_to_m < self.search_from_m + self.smallest_span_m {
            faults.push(format!(
                "`search_to_m` = {} leaves less than `smallest_span_m` = {} above `search_from_m` = {}",
                self.search_to_m, self.smallest_span_m, self.search_from_m
            ));
        }
        if self.largest_dbh_m <= self.smallest_dbh_m {
            faults.push(format!(
                "`largest_dbh_m` = {} must be above `smallest_dbh_m` = {}",
                self.largest_dbh_m, self.smallest_dbh_m
            ));
        }
        faults
    }
}

/// How the points of a tree are put together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TreeCloudParams {
    /// Radius of the neighbourhood whose shape tells wood from leaves, in point spacings.
    #[schemars(range(min = 2.0, max = 20.0), extend("x-unit" = "1", "x-source" = "enough points for a stable shape"))]
    pub wood_spacings: f64,
    /// Fewer points than this make no tree.
    #[schemars(range(min = 10, max = 1_000_000), extend("x-unit" = "points", "x-source" = "no skeleton follows from fewer"))]
    pub smallest_points: u32,
}

impl Default for TreeCloudParams {
    fn default() -> Self {
        Self { wood_spacings: 6.0, smallest_points: 50 }
    }
}
