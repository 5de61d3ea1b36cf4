//! The tree table of a tile. Raise the version when the fields or their meaning change.
//!
//! * Version 3: the score of the detection and what the tree was found by.
//! * Version 2 (`v2.rs`): the fitted surface with its centre, apex, rotation, objective and certificate; the
//!   extent of the position beside its standard error; the method that made the position.
//! * Version 1 (`v1.rs`). Both are read and migrated.

mod v1;
mod v2;

use super::table_kind;
use crate::kinds::{CrownShape, CrownStatus, Origin};
use serde::{Deserialize, Serialize};

/// Trees whose apex lies in the tile, sorted by id.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Trees {
    /// The trees.
    pub trees: Vec<Tree>,
}

/// The method that made a tree's position.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
pub enum PositionMethod {
    /// The highest point: asked for, or there was no usable fit.
    #[default]
    HighestPoint,
    /// Centre of the elliptic paraboloid with the smallest sum of absolute residuals.
    L1,
    /// Centre of the elliptic paraboloid with the smallest sum of squared residuals.
    L2,
    /// Centroid of the convex hull of the crown's points.
    HullCentroid,
    /// Peak of a consensus crown model.
    StarSac,
}

impl PositionMethod {
    /// The method's name in tables and parameters.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::HighestPoint => "highest-point",
            Self::L1 => "l1",
            Self::L2 => "l2",
            Self::HullCentroid => "hull-centroid",
            Self::StarSac => "starsac",
        }
    }
}

/// Something to know about a tree; a bit set in [`Tree::flags`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u32)]
pub enum TreeFlag {
    /// Too few or degenerate cells: no surface.
    Underdetermined = 0,
    /// As many cells as unknowns.
    NoRedundancy = 1,
    /// A limit of the axes is active: flat, hollow or needle-like crown.
    ShapeBoundActive = 2,
    /// The centre lies outside the data.
    CentreOutsideData = 3,
    /// Points on one flank only.
    OneSided = 4,
    /// The centre lies on the prior's box.
    PriorActive = 5,
    /// The limit of the axes' ratio is active.
    ImbalanceActive = 6,
    /// The crown model was rejected.
    ModelRejected = 7,
    /// The crown is cut by the edge of the scanned area.
    AtSurveyEdge = 8,
    /// The best surface is no elliptic paraboloid that opens downward, and has no apex.
    NotElliptic = 9,
    /// The fit stopped with an error, which is among the warnings.
    FitFailed = 10,
}

impl TreeFlag {
    /// All flags.
    pub const ALL: [Self; 11] = [
        Self::Underdetermined,
        Self::NoRedundancy,
        Self::ShapeBoundActive,
        Self::CentreOutsideData,
        Self::OneSided,
        Self::PriorActive,
        Self::ImbalanceActive,
        Self::ModelRejected,
        Self::AtSurveyEdge,
        Self::NotElliptic,
        Self::FitFailed,
    ];

    /// The flag's bit.
    #[must_use]
    pub fn bit(self) -> u32 {
        1 << (self as u32)
    }

    /// The flag's name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Underdetermined => "underdetermined",
            Self::NoRedundancy => "no-redundancy",
            Self::ShapeBoundActive => "shape-bound-active",
            Self::CentreOutsideData => "centre-outside-data",
            Self::OneSided => "one-sided",
            Self::PriorActive => "prior-active",
            Self::ImbalanceActive => "imbalance-active",
            Self::ModelRejected => "model-rejected",
            Self::AtSurveyEdge => "at-survey-edge",
            Self::NotElliptic => "not-elliptic",
            Self::FitFailed => "fit-failed",
        }
    }

    /// Names of the flags in a set of bits, separated by spaces.
    #[must_use]
    pub fn names(bits: u32) -> String {
        let set = Self::ALL.iter().filter(|flag| bits & flag.bit() != 0).map(|flag| flag.name());
        set.collect::<Vec<_>>().join(" ")
    }
}

/// One tree.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Tree {
    /// Tree id.
    pub id: u64,
    /// World position of the highest point, metres.
    pub apex_m: [f64; 3],
    /// Ground elevation below the apex, metres; NaN where unknown.
    pub ground_m: f64,
    /// Height of the apex above the ground surface there, metres.
    pub height_m: f64,
    /// World position taken for the stem, metres.
    pub position_m: [f64; 2],
    /// The method that made the position.
    pub position_method: PositionMethod,
    /// Radius around the position of the centres, within the prior, whose best surface has an
    /// objective within 0.1 % of the smallest, metres; NaN where it was not computed.
    pub position_extent_m: f64,
    /// Asymptotic standard error of the position without regard to the prior, metres (both axes
    /// together); NaN without one.
    pub position_standard_error_m: f64,
    /// World position of the fitted surface's centre, metres; NaN without a surface that has one. It
    /// is the position, unless the flags say why not.
    pub surface_centre_m: [f64; 2],
    /// Elevation of the fitted surface at its centre, metres; NaN without a surface.
    pub surface_apex_m: f64,
    /// Semi-axes of the fitted surface one metre below its apex, the larger first, metres; NaN
    /// without a surface.
    pub semi_axes_m: [f64; 2],
    /// Rotation of the fitted surface: azimuth of its larger semi-axis, degrees clockwise from grid
    /// north, at least 0 and below 180; NaN for equal axes and without a surface.
    pub rotation_deg: f64,
    /// Cells of the thinned crown that the fit saw (of a consensus model: points); 0 without a surface.
    pub fit_cells: u32,
    /// Sum of the cells' absolute vertical residuals, metres; NaN without a surface.
    pub fit_objective_m: f64,
    /// Mean of these residuals, metres; NaN without a surface.
    pub fit_residual_m: f64,
    /// Certified relative gap: no surface has an objective smaller by more than this share; NaN for
    /// methods without a certificate.
    pub fit_gap: f64,
    /// Problems solved until the optimum over the position prior was certified; 0 without a
    /// certificate.
    pub fit_nodes: u32,
    /// Form of the crown model.
    pub shape: CrownShape,
    /// Parameters of the crown model.
    pub parameters: [f64; 2],
    /// Whether the crown model stands.
    pub status: CrownStatus,
    /// Crown radius of the crown model, metres.
    pub crown_radius_m: f64,
    /// Inliers of the crown model.
    pub inliers: u32,
    /// Outliers of the crown model.
    pub outliers: u32,
    /// Points labelled with the tree.
    pub points: u32,
    /// Area of the crown polygon, square metres.
    pub crown_area_m2: f64,
    /// Largest width of the crown polygon, metres.
    pub crown_diameter_max_m: f64,
    /// Diameter of the circle of the crown's area, metres.
    pub crown_diameter_mean_m: f64,
    /// Height of the crown's base above ground, metres; NaN where it cannot be told.
    pub crown_base_m: f64,
    /// Crown outline in world coordinates, counter-clockwise, not closed; empty when there is none.
    pub crown_m: Vec<[f64; 2]>,
    /// Bits of [`TreeFlag`].
    pub flags: u32,
    /// How sure it is that this is a tree, 0 to 1; NaN where it was not told.
    pub score: f32,
    /// What it was found by.
    pub origin: Origin,
}

impl Tree {
    /// A tree of which everything about a fitted surface is missing, and all else at its default.
    #[must_use]
    pub fn without_fit() -> Self {
        Self {
            position_extent_m: f64::NAN,
            position_standard_error_m: f64::NAN,
            surface_centre_m: [f64::NAN; 2],
            surface_apex_m: f64::NAN,
            semi_axes_m: [f64::NAN; 2],
            rotation_deg: f64::NAN,
            fit_objective_m: f64::NAN,
            fit_residual_m: f64::NAN,
            fit_gap: f64::NAN,
            score: f32::NAN,
            ..Self::default()
        }
    }
}

table_kind!(Trees, "trees", 3, "the tree table of a tile", 1 => v1::Trees, 2 => v2::Trees);
