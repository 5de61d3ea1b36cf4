//! The terrain of a tile. Raise the version when the fields, the kernel or the blending change.

use super::table_kind;
use crate::Raster;
use serde::{Deserialize, Serialize};

/// Terrain model of one tile: the raster and the patches that allow evaluation anywhere in the tile.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GroundModel {
    /// Terrain elevations in metres at the cells whose centres lie in the tile.
    pub raster: Raster,
    /// The Hardy patches whose support touches the tile, sorted by centre.
    pub patches: Vec<HardyPatch>,
}

/// One multiquadric patch: `z(p) = z0 + t0 + t1 dx + t2 dy + sum_j c_j sqrt(|p - p_j|^2 + D^2)` with
/// `(dx, dy) = p - centre`, weighted by a bump that vanishes outside the support.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct HardyPatch {
    /// World position of the centre.
    pub centre_m: [f64; 2],
    /// Half the edge of the square outside which the patch has no weight.
    pub support_m: f64,
    /// Kernel offset D.
    pub offset_m: f64,
    /// Smoothing on the diagonal.
    pub smoothing_m: f64,
    /// Elevation that was subtracted before solving.
    pub z0_m: f64,
    /// Constant and slopes.
    pub trend: [f64; 3],
    /// Positions of the nodes relative to the centre.
    pub nodes_m: Vec<[f64; 2]>,
    /// Coefficients of the nodes.
    pub coefficients: Vec<f64>,
}

table_kind!(GroundModel, "ground-model", 1, "terrain raster and Hardy patches of a tile");
