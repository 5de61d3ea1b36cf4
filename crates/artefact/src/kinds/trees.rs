//! The tree table of a tile. Raise the version when the fields or their meaning change.

use super::table_kind;
use crate::kinds::{CrownShape, CrownStatus};
use serde::{Deserialize, Serialize};

/// Trees whose apex lies in the tile, sorted by id.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Trees {
    /// The trees.
    pub trees: Vec<Tree>,
}

/// Where a tree's position comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum PositionSource {
    /// Centre of the fitted crown surface.
    CrownFit,
    /// The highest point: there was no usable fit.
    #[default]
    HighestPoint,
}

/// Something to know about a tree; a bit set in [`Tree::flags`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u32)]
pub enum TreeFlag {
    /// Too few or degenerate cells: no surface.
    Underdetermined = 0,
    /// As many cells as unknowns.
    NoRedundancy = 1,
    /// The limit of the largest axis is active.
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
}

impl TreeFlag {
    /// All flags.
    pub const ALL: [Self; 9] = [
        Self::Underdetermined,
        Self::NoRedundancy,
        Self::ShapeBoundActive,
        Self::CentreOutsideData,
        Self::OneSided,
        Self::PriorActive,
        Self::ImbalanceActive,
        Self::ModelRejected,
        Self::AtSurveyEdge,
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
    /// Where the position comes from.
    pub position_source: PositionSource,
    /// Standard error of the position, metres (both axes together); NaN without a fit.
    pub position_uncertainty_m: f64,
    /// Semi-axes of the fitted surface one metre below its apex, metres; NaN without a fit.
    pub semi_axes_m: [f64; 2],
    /// Mean absolute residual of the fit, metres; NaN without a fit.
    pub fit_residual_m: f64,
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
}

table_kind!(Trees, "trees", 1, "the tree table of a tile");
