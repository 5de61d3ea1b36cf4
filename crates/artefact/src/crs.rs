//! Coordinate reference systems as they came from the files.

use serde::{Deserialize, Serialize};

/// A coordinate reference system: kept, not interpreted, except for its units.
///
/// Everything inside the pipeline is in metres; multiply a coordinate of the file by
/// `horizontal_m_per_unit` (x, y) or `vertical_m_per_unit` (z) to get there, divide to get back.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Crs {
    /// Well-known text as found in the file.
    pub wkt: Option<String>,
    /// EPSG code of the horizontal (or compound) system.
    pub epsg: Option<u32>,
    /// EPSG code of the vertical system where the file gives one.
    pub vertical_epsg: Option<u32>,
    /// A name for people.
    pub name: String,
    /// Metres in one unit of x and y: 1, 0.3048 or 1200/3937.
    pub horizontal_m_per_unit: f64,
    /// Metres in one unit of z.
    pub vertical_m_per_unit: f64,
}

impl Default for Crs {
    /// An unnamed system in metres: what a file without a CRS record is taken to be.
    fn default() -> Self {
        Self {
            wkt: None,
            epsg: None,
            vertical_epsg: None,
            name: "unknown (metres assumed)".to_owned(),
            horizontal_m_per_unit: 1.0,
            vertical_m_per_unit: 1.0,
        }
    }
}

impl Crs {
    /// Whether nothing is known but the units.
    #[must_use]
    pub fn is_unknown(&self) -> bool {
        self.wkt.is_none() && self.epsg.is_none()
    }

    /// Pipeline coordinates (metres) to coordinates of the system.
    #[must_use]
    pub fn crs_from_world(&self, world_m: [f64; 3]) -> [f64; 3] {
        [
            world_m[0] / self.horizontal_m_per_unit,
            world_m[1] / self.horizontal_m_per_unit,
            world_m[2] / self.vertical_m_per_unit,
        ]
    }

    /// Coordinates of the system to pipeline coordinates (metres).
    #[must_use]
    pub fn world_from_crs(&self, crs: [f64; 3]) -> [f64; 3] {
        [
            crs[0] * self.horizontal_m_per_unit,
            crs[1] * self.horizontal_m_per_unit,
            crs[2] * self.vertical_m_per_unit,
        ]
    }
}
