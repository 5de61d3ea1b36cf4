//! Instruments and where they stand.

use crate::Error;
use crate::error::check;
use serde::{Deserialize, Serialize};

/// Where scans are taken around a single tree.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Layout {
    /// Tripods on an arc around the tree.
    Ring {
        /// Number of scan positions.
        positions: u32,
        /// Distance from the foot of the tree, m.
        distance_m: f64,
        /// Height of the instrument above the foot, m.
        instrument_m: f64,
        /// Part of the circle over which they are spread, degrees.
        arc_deg: f64,
    },
    /// Parallel flight lines over the tree, which scan across their way.
    Flight {
        /// Number of lines.
        lines: u32,
        /// Distance between them, m.
        spacing_m: f64,
        /// Height above the foot of the tree, m.
        height_m: f64,
        /// Distance along a line between sweeps, m.
        sweep_m: f64,
    },
}

/// One position of an instrument, and the directions in which it looks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Station {
    /// Position of the instrument, world, m.
    pub position_m: [f64; 3],
    /// Number that its points carry as `source_id`.
    pub source_id: u16,
    /// Azimuths from east towards north, first and last, degrees.
    pub azimuth_deg: [f64; 2],
    /// Elevations above the horizon, first and last, degrees. Below -90 the far side is seen.
    pub elevation_deg: [f64; 2],
}

/// A laser scanner and how it is set up. Defaults are those of [`ScanParams::tls`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScanParams {
    /// Positions around a single tree; [`super::PlotParams`] has its own.
    pub layout: Layout,
    /// Angle between neighbouring pulses, degrees.
    pub step_deg: f64,
    /// Lowest and highest elevation, degrees.
    pub elevation_deg: [f64; 2],
    /// Radius of the beam at the instrument, at 1/e² of the intensity, m.
    pub exit_radius_m: f64,
    /// Full angle of the beam, mrad.
    pub divergence_mrad: f64,
    /// Range beyond which nothing is measured, m.
    pub max_range_m: f64,
    /// Standard deviation of the range, m.
    pub range_noise_m: f64,
    /// Surfaces that one pulse hits closer together than this give one return between them, m.
    pub mixing_m: f64,
    /// Smallest distance between two returns of a pulse, m.
    pub resolution_m: f64,
    /// Most returns of a pulse.
    pub max_returns: u8,
    /// Share of the light of a perfect target within the reference range below which nothing is seen.
    pub sensitivity: f64,
    /// Share of the pulses that give a stray point at any range.
    pub stray_share: f64,
    /// Whether a single tree stands on level, slightly rough ground.
    pub ground: bool,
}

impl Default for ScanParams {
    fn default() -> Self {
        Self::tls()
    }
}

impl ScanParams {
    /// Four tripods around the tree. Beam (7 mm, 0.35 mrad) and precision (3 mm) are those that RIEGL's
    /// data sheet tells of the VZ-400; 0.06 degrees give a point per centimetre at 10 m.
    #[must_use]
    pub fn tls() -> Self {
        Self {
            layout: Layout::Ring {
                positions: 4,
                distance_m: 9.0,
                instrument_m: 1.5,
                arc_deg: 360.0,
            },
            step_deg: 0.06,
            elevation_deg: [-50.0, 88.0],
            exit_radius_m: 0.0035,
            divergence_mrad: 0.35,
            max_range_m: 80.0,
            range_noise_m: 0.003,
            mixing_m: 0.2,
            resolution_m: 0.6,
            max_returns: 4,
            sensitivity: 0.02,
            stray_share: 1e-5,
            ground: false,
        }
    }

    /// Three flight lines of a drone at 45 m; beam 0.5 mrad, precision 1 cm.
    #[must_use]
    pub fn uav() -> Self {
        Self {
            layout: Layout::Flight { lines: 3, spacing_m: 12.0, height_m: 45.0, sweep_m: 0.04 },
            step_deg: 0.05,
            elevation_deg: [-135.0, -45.0],
            exit_radius_m: 0.005,
            divergence_mrad: 0.5,
            max_range_m: 150.0,
            range_noise_m: 0.01,
            mixing_m: 0.3,
            resolution_m: 0.8,
            max_returns: 5,
            ..Self::tls()
        }
    }

    /// Two tripods on one side, so that stems show less than half of their outline.
    #[must_use]
    pub fn one_sided() -> Self {
        let layout =
            Layout::Ring { positions: 2, distance_m: 10.0, instrument_m: 1.5, arc_deg: 25.0 };
        Self { layout, ..Self::tls() }
    }

    /// The same without noise, divergence and stray points: positions exactly on surfaces.
    #[must_use]
    pub fn exact(mut self) -> Self {
        (self.range_noise_m, self.stray_share) = (0.0, 0.0);
        (self.exit_radius_m, self.divergence_mrad) = (0.0, 0.0);
        self
    }

    /// The same with another angle between pulses, degrees.
    #[must_use]
    pub fn with_step(mut self, step_deg: f64) -> Self {
        self.step_deg = step_deg;
        self
    }

    /// The same with ground under a single tree.
    #[must_use]
    pub fn with_ground(mut self) -> Self {
        self.ground = true;
        self
    }

    pub(crate) fn check(&self) -> Result<(), Error> {
        check("step_deg", self.step_deg, 0.005..=10.0, "0.005 to 10 degrees")?;
        let [low, high] = self.elevation_deg;
        check("elevation_deg", low, -180.0..=90.0, "-180 to 90 degrees")?;
        check("elevation_deg", high, low..=90.0, "from the lowest elevation to 90 degrees")?;
        check("exit_radius_m", self.exit_radius_m, 0.0..=0.1, "0 to 0.1 m")?;
        check("divergence_mrad", self.divergence_mrad, 0.0..=20.0, "0 to 20 mrad")?;
        check("max_range_m", self.max_range_m, 1.0..=1000.0, "1 to 1000 m")?;
        check("range_noise_m", self.range_noise_m, 0.0..=0.2, "0 to 0.2 m")?;
        check("mixing_m", self.mixing_m, 0.0..=5.0, "0 to 5 m")?;
        check("resolution_m", self.resolution_m, 0.0..=5.0, "0 to 5 m")?;
        check("max_returns", f64::from(self.max_returns), 1.0..=15.0, "1 to 15")?;
        check("sensitivity", self.sensitivity, 0.0..=1.0, "0 to 1")?;
        check("stray_share", self.stray_share, 0.0..=0.1, "0 to 0.1")?;
        self.layout.check()
    }

    /// Scan positions around a foot.
    pub(crate) fn stations(&self, base_m: [f64; 3]) -> Vec<Station> {
        match self.layout {
            Layout::Ring { positions, distance_m, instrument_m, arc_deg } => (0..positions)
                .map(|index| {
                    let angle = arc_deg * f64::from(index) / f64::from(positions) - 90.0;
                    let (sin, cos) = libm::sincos(angle.to_radians());
                    let [x, y, z] = base_m;
                    let at = [x + distance_m * cos, y + distance_m * sin, z + instrument_m];
                    self.tripod(at, index as u16 + 1)
                })
                .collect(),
            Layout::Flight { lines, spacing_m, height_m, sweep_m } => {
                let along = (2.0 * height_m / sweep_m).ceil() as u32;
                let station = |index: u32| {
                    let (line, sweep) = (index / along, index % along);
                    let across = spacing_m * (f64::from(line) - 0.5 * f64::from(lines - 1));
                    let way = sweep_m * (f64::from(sweep) - 0.5 * f64::from(along));
                    let [x, y, z] = base_m;
                    let position_m = [x + across, y + way, z + height_m];
                    let elevation_deg = self.elevation_deg;
                    let source_id = line as u16 + 1;
                    Station { position_m, source_id, azimuth_deg: [0.0; 2], elevation_deg }
                };
                (0..lines * along).map(station).collect()
            }
        }
    }

    /// A position that looks all around.
    pub(crate) fn tripod(&self, position_m: [f64; 3], source_id: u16) -> Station {
        let azimuth_deg = [0.0, 360.0 - self.step_deg];
        Station { position_m, source_id, azimuth_deg, elevation_deg: self.elevation_deg }
    }
}

impl Layout {
    fn check(&self) -> Result<(), Error> {
        match *self {
            Self::Ring { positions, distance_m, instrument_m, arc_deg } => {
                check("positions", f64::from(positions), 1.0..=1000.0, "1 to 1000")?;
                check("distance_m", distance_m, 0.5..=200.0, "0.5 to 200 m")?;
                check("instrument_m", instrument_m, -50.0..=100.0, "-50 to 100 m")?;
                check("arc_deg", arc_deg, 0.0..=360.0, "0 to 360 degrees")
            }
            Self::Flight { lines, spacing_m, height_m, sweep_m } => {
                check("lines", f64::from(lines), 1.0..=100.0, "1 to 100")?;
                check("spacing_m", spacing_m, 0.0..=200.0, "0 to 200 m")?;
                check("height_m", height_m, 2.0..=500.0, "2 to 500 m")?;
                check("sweep_m", sweep_m, 0.005..=10.0, "0.005 to 10 m")
            }
        }
    }
}
