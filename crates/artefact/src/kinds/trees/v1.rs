//! Version 1 of the tree table: one fitting method, a fit without its centre, axes or certificate.

use super::PositionMethod;
use crate::kinds::{CrownShape, CrownStatus};
use serde::{Deserialize, Serialize};

/// Trees as version 1 wrote them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Trees {
    trees: Vec<Tree>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
enum PositionSource {
    CrownFit,
    #[default]
    HighestPoint,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Tree {
    id: u64,
    apex_m: [f64; 3],
    ground_m: f64,
    height_m: f64,
    position_m: [f64; 2],
    position_source: PositionSource,
    /// The standard error, under a name that promised more.
    position_uncertainty_m: f64,
    semi_axes_m: [f64; 2],
    fit_residual_m: f64,
    shape: CrownShape,
    parameters: [f64; 2],
    status: CrownStatus,
    crown_radius_m: f64,
    inliers: u32,
    outliers: u32,
    points: u32,
    crown_area_m2: f64,
    crown_diameter_max_m: f64,
    crown_diameter_mean_m: f64,
    crown_base_m: f64,
    crown_m: Vec<[f64; 2]>,
    flags: u32,
}

impl From<Trees> for super::Trees {
    fn from(old: Trees) -> Self {
        Self { trees: old.trees.into_iter().map(Into::into).collect() }
    }
}

impl From<Tree> for super::Tree {
    /// The only fit of version 1 was the L1 paraboloid with equal axes; its centre is known where
    /// it was taken for the position. What was not kept is missing.
    fn from(old: Tree) -> Self {
        let (position_method, surface_centre_m) = match old.position_source {
            PositionSource::CrownFit => (PositionMethod::L1, old.position_m),
            PositionSource::HighestPoint => (PositionMethod::HighestPoint, [f64::NAN; 2]),
        };
        Self {
            id: old.id,
            apex_m: old.apex_m,
            ground_m: old.ground_m,
            height_m: old.height_m,
            position_m: old.position_m,
            position_method,
            position_standard_error_m: old.position_uncertainty_m,
            surface_centre_m,
            semi_axes_m: old.semi_axes_m,
            fit_residual_m: old.fit_residual_m,
            shape: old.shape,
            parameters: old.parameters,
            status: old.status,
            crown_radius_m: old.crown_radius_m,
            inliers: old.inliers,
            outliers: old.outliers,
            points: old.points,
            crown_area_m2: old.crown_area_m2,
            crown_diameter_max_m: old.crown_diameter_max_m,
            crown_diameter_mean_m: old.crown_diameter_mean_m,
            crown_base_m: old.crown_base_m,
            crown_m: old.crown_m,
            flags: old.flags,
            ..Self::without_fit()
        }
    }
}
