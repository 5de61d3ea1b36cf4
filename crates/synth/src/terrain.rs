//! Ground with slopes, ridges and gullies, known exactly everywhere.

use crate::Error;
use crate::error::check;
use crate::noise::{gradient_noise, line_noise};
use crate::random::{Domain, Stream};
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Frame;

/// One scale of relief: gradient noise of a wavelength and an amplitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relief {
    /// Distance between lattice points, m.
    pub wavelength_m: f64,
    /// Height of the largest bumps above the mean, about, m.
    pub amplitude_m: f64,
}

/// A channel cut into the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gully {
    /// A position on its line, metres from the origin of the scene.
    pub through_m: [f64; 2],
    /// Direction of its line, degrees from east towards north.
    pub direction_deg: f64,
    /// Depth below the ground around it, m.
    pub depth_m: f64,
    /// Distance from its line at which it has 35 % of its depth, m.
    pub half_width_m: f64,
    /// How far the channel leaves its line, m.
    pub meander_m: f64,
    /// Distance between bends, m.
    pub meander_wavelength_m: f64,
}

/// The ground of a scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainParams {
    /// Elevation at the origin of the scene before relief, m.
    pub base_m: f64,
    /// Slope of the plane under it all, degrees.
    pub slope_deg: f64,
    /// Direction in which that plane rises, degrees from east towards north.
    pub uphill_deg: f64,
    /// Rounded relief, any number of scales.
    pub relief: Vec<Relief>,
    /// Ridged relief: sharp crests, wide hollows.
    pub ridges: Vec<Relief>,
    /// Channels.
    pub gullies: Vec<Gully>,
}

impl Default for TerrainParams {
    /// A hillside of 12 degrees with relief at four scales.
    fn default() -> Self {
        let relief = [(240.0, 9.0), (70.0, 2.5), (21.0, 0.8), (6.0, 0.2)];
        Self {
            base_m: 500.0,
            slope_deg: 12.0,
            uphill_deg: 60.0,
            relief: relief
                .map(|(wavelength_m, amplitude_m)| Relief { wavelength_m, amplitude_m })
                .into(),
            ridges: vec![Relief { wavelength_m: 160.0, amplitude_m: 4.0 }],
            gullies: Vec::new(),
        }
    }
}

impl TerrainParams {
    /// A level plane.
    #[must_use]
    pub fn level(base_m: f64) -> Self {
        let (relief, ridges, gullies) = (Vec::new(), Vec::new(), Vec::new());
        Self { base_m, slope_deg: 0.0, uphill_deg: 0.0, relief, ridges, gullies }
    }

    fn check(&self) -> Result<(), Error> {
        check("slope_deg", self.slope_deg, 0.0..=60.0, "0 to 60 degrees")?;
        for scale in self.relief.iter().chain(&self.ridges) {
            check("relief wavelength_m", scale.wavelength_m, 0.5..=1e5, "0.5 to 100000 m")?;
        }
        for gully in &self.gullies {
            check("gully half_width_m", gully.half_width_m, 0.2..=1e4, "0.2 to 10000 m")?;
            check(
                "gully meander_wavelength_m",
                gully.meander_wavelength_m,
                1.0..=1e5,
                "1 m or more",
            )?;
        }
        Ok(())
    }
}

/// Elevation and gradient at a position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Elevation, m.
    pub z: f64,
    /// Rise per metre to the east and to the north.
    pub gradient: [f64; 2],
}

impl Surface {
    const LEVEL: Self = Self { z: 0.0, gradient: [0.0; 2] };

    fn add(&mut self, z: f64, gradient: [f64; 2]) {
        self.z += z;
        self.gradient[0] += gradient[0];
        self.gradient[1] += gradient[1];
    }

    /// Inclination, degrees.
    #[must_use]
    pub fn slope_deg(&self) -> f64 {
        libm::atan(libm::hypot(self.gradient[0], self.gradient[1])).to_degrees()
    }
}

/// One prepared term of noise.
#[derive(Debug, Clone, Copy)]
struct Octave {
    frequency: f64,
    amplitude_m: f64,
    salt: u64,
}

/// A prepared channel: unit vectors along and across its line.
#[derive(Debug, Clone, Copy)]
struct Channel {
    gully: Gully,
    along: [f64; 2],
    salt: u64,
}

/// Ground known exactly everywhere.
#[derive(Debug, Clone)]
pub struct Terrain {
    frame: Frame,
    base_m: f64,
    plane: [f64; 2],
    relief: Vec<Octave>,
    ridges: Vec<Octave>,
    channels: Vec<Channel>,
}

/// Smallest |noise| of a crest: rounds ridges over a few decimetres to metres.
const CREST: f64 = 0.04;

impl Terrain {
    /// Prepares the ground of a scene; `frame` gives the origin its positions are counted from.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a slope, wavelength or width out of range.
    pub fn new(params: &TerrainParams, frame: Frame, seed: u64) -> Result<Self, Error> {
        params.check()?;
        let mut salts = Stream::new(seed, Domain::Noise, 0);
        let mut octaves = |list: &[Relief]| -> Vec<Octave> {
            list.iter()
                .map(|scale| Octave {
                    frequency: 1.0 / scale.wavelength_m,
                    amplitude_m: scale.amplitude_m,
                    salt: salts.bits(),
                })
                .collect()
        };
        let (relief, ridges) = (octaves(&params.relief), octaves(&params.ridges));
        let channels = params.gullies.iter().map(|gully| {
            let (sin, cos) = libm::sincos(gully.direction_deg.to_radians());
            Channel { gully: *gully, along: [cos, sin], salt: salts.bits() }
        });
        let channels = channels.collect();
        let rise = libm::tan(params.slope_deg.to_radians());
        let (sin, cos) = libm::sincos(params.uphill_deg.to_radians());
        let plane = [rise * cos, rise * sin];
        Ok(Self { frame, base_m: params.base_m, plane, relief, ridges, channels })
    }

    /// Elevation in metres at a world position.
    #[must_use]
    pub fn elevation_m(&self, world_x_m: f64, world_y_m: f64) -> f64 {
        self.surface_m(world_x_m, world_y_m).z
    }

    /// Elevation and gradient at a world position.
    #[must_use]
    pub fn surface_m(&self, world_x_m: f64, world_y_m: f64) -> Surface {
        let [x, y, _] = self.frame.local_from_world([world_x_m, world_y_m, 0.0]);
        self.local(x, y)
    }

    /// Elevation and gradient at a position in the scene's frame.
    pub(crate) fn local(&self, x: f64, y: f64) -> Surface {
        let mut surface = Surface::LEVEL;
        surface.add(self.base_m + self.plane[0] * x + self.plane[1] * y, self.plane);
        for octave in &self.relief {
            let (value, gradient) = octave.at(x, y);
            surface.add(octave.amplitude_m * value, gradient.map(|g| octave.amplitude_m * g));
        }
        for octave in &self.ridges {
            let (value, gradient) = octave.at(x, y);
            let height = (value * value + CREST * CREST).sqrt();
            let factor = -octave.amplitude_m * value / height;
            surface.add(-octave.amplitude_m * height, gradient.map(|g| factor * g));
        }
        for channel in &self.channels {
            let (cut, gradient) = channel.at(x, y);
            surface.add(cut, gradient);
        }
        surface
    }
}

impl Octave {
    fn at(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        let (value, gradient) = gradient_noise(x * self.frequency, y * self.frequency, self.salt);
        (value, gradient.map(|g| g * self.frequency))
    }
}

impl Channel {
    /// Depth profile (1 + q^2)^(-3/2) over the distance q from the meandering line in half-widths.
    fn at(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        let gully = &self.gully;
        let ([cos, sin], [px, py]) = (self.along, gully.through_m);
        let along = cos * (x - px) + sin * (y - py);
        let across = cos * (y - py) - sin * (x - px);
        let (bend, bend_slope) = line_noise(along / gully.meander_wavelength_m, self.salt);
        let q = (across - gully.meander_m * bend) / gully.half_width_m;
        let r = 1.0 / (1.0 + q * q);
        let profile = r * r.sqrt();
        let per_q = gully.depth_m * 3.0 * q * r * profile;
        let q_across = 1.0 / gully.half_width_m;
        let q_along =
            -gully.meander_m * bend_slope / (gully.meander_wavelength_m * gully.half_width_m);
        let gradient =
            [per_q * (q_along * cos - q_across * sin), per_q * (q_along * sin + q_across * cos)];
        (-gully.depth_m * profile, gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn rugged() -> Terrain {
        let gully = Gully {
            through_m: [30.0, 20.0],
            direction_deg: 25.0,
            depth_m: 6.0,
            half_width_m: 7.0,
            meander_m: 9.0,
            meander_wavelength_m: 45.0,
        };
        let params = TerrainParams { gullies: vec![gully], ..TerrainParams::default() };
        Terrain::new(&params, Frame::new([500, -300, 0]), 11).unwrap()
    }

    proptest! {
        #[test]
        fn gradient_is_that_of_the_elevation(x in 300f64..800., y in -500f64..0.) {
            let (terrain, step) = (rugged(), 1e-5);
            let [gx, gy] = terrain.surface_m(x, y).gradient;
            let at = |x, y| terrain.elevation_m(x, y);
            prop_assert!(((at(x + step, y) - at(x - step, y)) / (2.0 * step) - gx).abs() < 1e-4);
            prop_assert!(((at(x, y + step) - at(x, y - step)) / (2.0 * step) - gy).abs() < 1e-4);
        }
    }

    #[test]
    fn a_gully_has_its_depth() {
        let gully = Gully {
            through_m: [0.0, 0.0],
            direction_deg: 90.0,
            depth_m: 5.0,
            half_width_m: 4.0,
            meander_m: 0.0,
            meander_wavelength_m: 10.0,
        };
        let params = TerrainParams { gullies: vec![gully], ..TerrainParams::level(100.0) };
        let terrain = Terrain::new(&params, Frame::default(), 1).unwrap();
        assert!((terrain.elevation_m(0.0, 33.0) - 95.0).abs() < 1e-12);
        assert!((terrain.elevation_m(400.0, 0.0) - 100.0).abs() < 1e-4);
    }

    #[test]
    fn a_wavelength_of_nothing_is_refused() {
        let relief = vec![Relief { wavelength_m: 0.0, amplitude_m: 1.0 }];
        let params = TerrainParams { relief, ..TerrainParams::default() };
        let error = Terrain::new(&params, Frame::default(), 1).unwrap_err();
        assert!(error.to_string().contains("wavelength_m` is 0"), "{error}");
    }
}
