//! The terrain of a tile. Raise the version when the fields, the kernel or the blending change.

use super::table_kind;
use crate::Raster;
use serde::{Deserialize, Serialize};

/// Terrain model of one tile: the raster and the patches that allow evaluation anywhere in the tile.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct GroundModel {
    /// Terrain elevations in metres at the cells whose centres lie in the tile.
    pub raster: Raster,
    /// The Hardy patches with weight in the tile, in the order of their summation.
    pub patches: Vec<HardyPatch>,
}

/// One multiquadric patch: with `(dx, dy) = p - centre`,
/// `z(p) = datum + t0 + t1 dx + t2 dy + sum_j c_j sqrt((dx - x_j)^2 + (dy - y_j)^2 + D^2)`.
/// Its weight is 1 in the middle half of the square around the centre and falls to 0 as far outside.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct HardyPatch {
    /// World position of the centre.
    pub centre_m: [f64; 2],
    /// Edge of the square, a power of two.
    pub edge_m: f64,
    /// Elevation of the surface's zero.
    pub datum_m: f64,
    /// Square of the kernel offset D, m².
    pub offset_squared_m2: f64,
    /// Constant (metres) and slopes.
    pub trend: [f64; 3],
    /// Positions of the nodes relative to the centre.
    pub nodes_m: Vec<[f64; 2]>,
    /// Coefficients of the nodes.
    pub coefficients: Vec<f64>,
}

table_kind!(GroundModel, "ground-model", 1, "terrain raster and Hardy patches of a tile");
