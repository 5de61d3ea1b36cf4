//! Version 2 of the tree table: without what detection said.

use super::PositionMethod;
use crate::kinds::{CrownShape, CrownStatus};
use serde::{Deserialize, Serialize};

/// Trees as version 2 wrote them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Trees {
    trees: Vec<Tree>,
}

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
struct Tree {
    id: u64,
    apex_m: [f64; 3],
    ground_m: f64,
    height_m: f64,
    position_m: [f64; 2],
    position_method: PositionMethod,
    position_extent_m: f64,
    position_standard_error_m: f64,
    surface_centre_m: [f64; 2],
    surface_apex_m: f64,
    semi_axes_m: [f64; 2],
    rotation_deg: f64,
    fit_cells: u32,
    fit_objective_m: f64,
    fit_residual_m: f64,
    fit_gap: f64,
    fit_nodes: u32,
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
    fn from(old: Tree) -> Self {
        Self {
            id: old.id,
            apex_m: old.apex_m,
            ground_m: old.ground_m,
            height_m: old.height_m,
            position_m: old.position_m,
            position_method: old.position_method,
            position_extent_m: old.position_extent_m,
            position_standard_error_m: old.position_standard_error_m,
            surface_centre_m: old.surface_centre_m,
            surface_apex_m: old.surface_apex_m,
            semi_axes_m: old.semi_axes_m,
            rotation_deg: old.rotation_deg,
            fit_cells: old.fit_cells,
            fit_objective_m: old.fit_objective_m,
            fit_residual_m: old.fit_residual_m,
            fit_gap: old.fit_gap,
            fit_nodes: old.fit_nodes,
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
