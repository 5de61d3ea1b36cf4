//! Parameters of the two stages.

use crate::crs::UnitChoice;
use crate::epsg::{INTERNATIONAL_FOOT_M, US_SURVEY_FOOT_M};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LengthUnit {
    /// As the file says; metres where it says nothing.
    #[default]
    Auto,
    /// Metres.
    Metre,
    /// International feet of 0.3048 m.
    InternationalFoot,
    /// US survey feet of 1200/3937 m.
    UsSurveyFoot,
}

impl LengthUnit {
    /// Metres in one unit; `None` for [`LengthUnit::Auto`].
    #[must_use]
    pub fn metres(self) -> Option<f64> {
        match self {
            Self::Auto => None,
            Self::Metre => Some(1.0),
            Self::InternationalFoot => Some(INTERNATIONAL_FOOT_M),
            Self::UsSurveyFoot => Some(US_SURVEY_FOOT_M),
        }
    }
}

/// What to do with a file that is cut off or damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Damaged {
    /// Refuse it, saying how many points could be read.
    #[default]
    Refuse,
    /// Use the points that can be read, with a warning.
    Keep,
}

/// What to do with points of flight-line overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Overlap {
    /// Use them: they add density.
    #[default]
    Keep,
    /// Leave them out: density and angles are then those of one flight line.
    Drop,
}

/// Parameters of the stage `scatter`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ScatterParams {
    /// What to do with a file that is cut off or damaged: `refuse` or `keep` what can be read.
    pub damaged: Damaged,
    /// Unit of x and y: `auto` takes the file's, the others replace it.
    pub horizontal_unit: LengthUnit,
    /// Unit of z: `auto` takes the file's, or that of x and y where the file does not say.
    pub vertical_unit: LengthUnit,
}

impl ScatterParams {
    /// The units that replace the file's.
    #[must_use]
    pub fn units(&self) -> UnitChoice {
        UnitChoice { horizontal: self.horizontal_unit, vertical: self.vertical_unit }
    }
}

impl timberline_artefact::stage::Params for ScatterParams {}

/// Parameters of the stage `tiles`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TilesParams {
    /// Whether points flagged as withheld are left out.
    #[schemars(extend("x-source" = "ASPRS LAS 1.4-R15, table 8"))]
    pub drop_withheld: bool,
    /// Whether points of the classes 7 (low noise) and 18 (high noise) are left out.
    #[schemars(extend("x-source" = "ASPRS LAS 1.4-R15, tables 9 and 17"))]
    pub drop_noise: bool,
    /// What to do with points flagged as overlap or of class 12: `keep` or `drop`.
    #[schemars(extend("x-source" = "ASPRS LAS 1.4-R15, tables 9 and 16"))]
    pub overlap: Overlap,
    /// Points that hang above everything, such as birds and clouds, are left out when the 9 voxel
    /// columns of 4 m around hold at most this many from one voxel below them upwards, then an empty
    /// layer, then ten times as many. 0 keeps all points.
    #[schemars(range(max = 1000), extend("x-unit" = "points", "x-source" = "after LAStools, lasnoise (step 4) and lidR, ivf"))]
    pub isolated_points: u32,
    /// Of all points in a voxel of this edge only the one nearest to their centroid is kept; 0 keeps
    /// all. The edge is rounded down to a whole fraction of a metre (0.03 to 1/34).
    #[schemars(range(min = 0.0, max = 1.0), extend("x-unit" = "m", "x-source" = "METHODS.md 3; lattice fixed in the world"))]
    pub thin_m: f64,
    /// Points whose mean distance to their nearest neighbours is more than this many times the median
    /// of their neighbours' get class 7 (noise), after thinning. 0 marks none: right for airborne
    /// scans, whose points are far apart; 3 suits terrestrial ones.
    #[schemars(range(min = 0.0, max = 100.0), extend("x-source" = "after Rusu et al. 2008, section 4.1; class as PDAL, filters.outlier"))]
    pub outlier_factor: f64,
    /// Number of nearest neighbours that are looked at.
    #[schemars(range(min = 2, max = 64), extend("x-unit" = "points", "x-source" = "PDAL, filters.outlier: mean_k 8"))]
    pub outlier_neighbours: u32,
    /// Neighbours farther away are none, and points with fewer than half of all neighbours are noise.
    #[schemars(range(min = 0.01, max = 10.0), extend("x-unit" = "m", "x-source" = "at 0.25 m a seventh of a sparse tree of 7,000 points was marked, cargo test -p timberline-ingest --test real_clouds"))]
    pub outlier_reach_m: f64,
}

impl Default for TilesParams {
    fn default() -> Self {
        Self {
            drop_withheld: true,
            drop_noise: true,
            overlap: Overlap::Keep,
            isolated_points: 2,
            thin_m: 0.0,
            outlier_factor: 0.0,
            outlier_neighbours: 8,
            outlier_reach_m: 1.0,
        }
    }
}

impl timberline_artefact::stage::Params for TilesParams {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unknown_parameters_are_refused() {
        let error = serde_json::from_str::<TilesParams>(r#"{"drop_noize": true}"#).unwrap_err();
        assert!(error.to_string().contains("drop_noize"));
        let some: ScatterParams = serde_json::from_str(r#"{"damaged": "keep"}"#).unwrap();
        assert_eq!(some.damaged, Damaged::Keep);
    }
}
