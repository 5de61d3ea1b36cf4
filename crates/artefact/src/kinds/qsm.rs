//! The cylinder model (quantitative structure model, QSM) of one tree. Raise the version when the
//! fields or their meaning change.

use super::{BaseSource, table_kind};
use serde::{Deserialize, Serialize};

/// The model of one tree. Positions are in the frame of the header.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Qsm {
    /// The tree.
    pub tree_id: u64,
    /// Base of the stem, world, m.
    pub base_m: [f64; 3],
    /// What the elevation of the base was taken from.
    pub base_source: BaseSource,
    /// The cylinders, every one after its parent.
    pub cylinders: Vec<QsmCylinder>,
    /// The branches, the stem first, every one after its parent.
    pub branches: Vec<QsmBranch>,
    /// What is read off the model and the points.
    pub metrics: TreeMetrics,
    /// From the points to the model.
    pub cloud_to_model: Distances,
    /// From the model's surface to the points, over the surface that could be seen.
    pub model_to_cloud: Distances,
    /// What consolidation brought.
    pub consolidation: ConsolidationEffect,
}

/// What a radius rests on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub enum RadiusSource {
    /// A fit to the points of the cylinder.
    Measured,
    /// Measured cylinders of the same branch on both sides of it, or on one.
    Interpolated,
    /// The pipe model: nothing could be measured on the branch.
    #[default]
    Inferred,
}

impl RadiusSource {
    /// The name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Interpolated => "interpolated",
            Self::Inferred => "inferred",
        }
    }
}

/// One cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QsmCylinder {
    /// Centre of the lower end, m.
    pub start_m: [f64; 3],
    /// Centre of the upper end, m.
    pub end_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
    /// Standard error of the radius, m; NaN where there is none.
    pub radius_sd_m: f64,
    /// What the radius rests on.
    pub source: RadiusSource,
    /// Part of the circumference that has points, 0 to 1.
    pub arc_coverage: f32,
    /// Number of points the fit rests on.
    pub points: u32,
    /// Place of the parent in [`Qsm::cylinders`]; none for the lowest.
    pub parent: Option<u32>,
    /// Place of its branch in [`Qsm::branches`].
    pub branch: u32,
}

/// One branch: cylinders one after the other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct QsmBranch {
    /// Place of the branch it grows on; none for the stem.
    pub parent: Option<u32>,
    /// 0 for the stem, 1 for branches on the stem, and so on.
    pub order: u16,
    /// Its first cylinder; the others follow it.
    pub first: u32,
    /// Number of cylinders.
    pub len: u32,
}

/// What foresters take away about one tree.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TreeMetrics {
    /// Diameter at breast height.
    pub dbh: Option<Dbh>,
    /// Height of the highest point above the base, m.
    pub height_m: f64,
    /// Height of the lowest branch of the living crown above the base, m.
    pub crown_base_m: Option<f64>,
    /// Area of the convex hull of the crown seen from above, m2.
    pub crown_area_m2: f64,
    /// Diameter of the circle with that area, m.
    pub crown_diameter_m: f64,
    /// Volume of the stem, m3.
    pub stem_volume_m3: f64,
    /// Volume of branches of a diameter of at least 5 cm, m3.
    pub thick_volume_m3: f64,
    /// Volume of branches below 5 cm of diameter, m3.
    pub thin_volume_m3: f64,
    /// Lateral surface of all cylinders, m2.
    pub surface_m2: f64,
    /// Length of all cylinders, m.
    pub length_m: f64,
    /// Diameter of the stem by height.
    pub taper: Vec<TaperStep>,
}

/// A diameter at breast height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Dbh {
    /// The diameter, m.
    pub diameter_m: f64,
    /// Its standard error, m.
    pub sd_m: f64,
    /// Part of the circumference that has points, 0 to 1.
    pub arc_coverage: f32,
    /// Number of points it rests on.
    pub points: u32,
    /// Whether it was measured at breast height or taken from measurements near it.
    pub source: RadiusSource,
}

/// The stem's diameter at a height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TaperStep {
    /// Height above the base, m.
    pub height_m: f64,
    /// Diameter, m.
    pub diameter_m: f64,
    /// What it rests on.
    pub source: RadiusSource,
}

/// Distances of many points.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Distances {
    /// How many.
    pub count: u64,
    /// Mean, m.
    pub mean_m: f64,
    /// Root of the mean square, m.
    pub rms_m: f64,
    /// 95th percentile, m.
    pub p95_m: f64,
    /// Largest, m.
    pub max_m: f64,
}

/// What consolidation brought to the model of a tree.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ConsolidationEffect {
    /// Whether the model was made from consolidated points.
    pub used: bool,
    /// Why not, if not.
    pub reason: String,
    /// Mean distance from the points to the model from the points as scanned, m.
    pub raw_mean_m: f64,
    /// Mean distance from the points to the model from consolidated points, m; NaN if not made.
    pub consolidated_mean_m: f64,
}

table_kind!(Qsm, "qsm", 1, "the cylinder model of one tree with its metrics");
