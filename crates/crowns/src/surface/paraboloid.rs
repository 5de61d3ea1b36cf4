//! The elliptic paraboloid: coefficients to shape and back.

use super::scale::Scale;

/// z = phi0 x² + phi1 y² + phi2 xy + phi3 x + phi4 y + phi5, opening downward
/// (Polewski et al., eq 1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paraboloid {
    /// The coefficients phi0 to phi5.
    pub phi: [f64; 6],
}

/// A paraboloid's geometry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// Position of the apex, m.
    pub centre: [f64; 2],
    /// Height of the apex, m.
    pub apex_z_m: f64,
    /// Semiaxes (radii one metre below the apex), the larger first, m.
    pub semiaxes_m: [f64; 2],
    /// Direction of the larger semiaxis from the x axis, 0 to π, rad; 0 where the axes are equal.
    pub azimuth: f64,
}

impl Paraboloid {
    /// The surface with the given curvatures phi0 to phi2 about an apex.
    pub(super) fn from_apex([p0, p1, p2]: [f64; 3], [x, y]: [f64; 2], top: f64) -> Self {
        let phi3 = -2.0 * p0 * x - p2 * y;
        let phi4 = -p2 * x - 2.0 * p1 * y;
        let phi5 = top + p0 * x * x + p1 * y * y + p2 * x * y;
        Self { phi: [p0, p1, p2, phi3, phi4, phi5] }
    }

    /// The same surface in metres, if its coefficients are in units of a scale.
    pub(super) fn in_metres(&self, scale: &Scale) -> Self {
        let (l, h, [x0, y0, z0]) = (scale.length_m, scale.height_m, scale.centre);
        let [p0, p1, p2] = [0, 1, 2].map(|k| self.phi[k] * h / (l * l));
        let [g0, g1] = [3, 4].map(|k| self.phi[k] * h / l);
        let phi3 = g0 - 2.0 * p0 * x0 - p2 * y0;
        let phi4 = g1 - p2 * x0 - 2.0 * p1 * y0;
        let about = p0 * x0 * x0 + p1 * y0 * y0 + p2 * x0 * y0;
        let phi5 = self.phi[5] * h + z0 + about - g0 * x0 - g1 * y0;
        Self { phi: [p0, p1, p2, phi3, phi4, phi5] }
    }

    /// The surface with the given shape.
    #[must_use]
    pub fn from_shape(shape: &Shape) -> Self {
        let [u, v] = shape.semiaxes_m.map(|axis| 1.0 / (axis * axis));
        let (sin, cos) = libm::sincos(shape.azimuth);
        let phi0 = -(cos * cos * u + sin * sin * v);
        let phi1 = -(sin * sin * u + cos * cos * v);
        let phi2 = -2.0 * sin * cos * (u - v);
        Self::from_apex([phi0, phi1, phi2], shape.centre, shape.apex_z_m)
    }

    /// Height of the surface at a position, m.
    #[must_use]
    pub fn z(&self, x: f64, y: f64) -> f64 {
        let [p0, p1, p2, p3, p4, p5] = self.phi;
        p0 * x * x + p1 * y * y + p2 * x * y + p3 * x + p4 * y + p5
    }

    /// Position of the apex: where the gradient vanishes.
    #[must_use]
    pub fn centre(&self) -> [f64; 2] {
        let [p0, p1, p2, p3, p4, _] = self.phi;
        let det = 4.0 * p0 * p1 - p2 * p2;
        [(p2 * p4 - 2.0 * p1 * p3) / det, (p2 * p3 - 2.0 * p0 * p4) / det]
    }

    /// The geometry, or `None` for a surface that is no elliptic paraboloid opening downward.
    #[must_use]
    pub fn shape(&self) -> Option<Shape> {
        let [p0, p1, p2, ..] = self.phi;
        let half_spread = 0.5 * ((p0 - p1) * (p0 - p1) + p2 * p2).sqrt();
        let mean = -0.5 * (p0 + p1);
        let curvatures = [mean - half_spread, mean + half_spread];
        if !(curvatures[0] > 0.0 && curvatures[1].is_finite()) {
            return None;
        }
        let centre = self.centre();
        let apex_z_m = self.z(centre[0], centre[1]);
        let semiaxes_m = curvatures.map(|curvature| 1.0 / curvature.sqrt());
        // The larger semiaxis is the direction of least curvature: half the angle of (p0-p1, p2).
        let azimuth = if half_spread > 0.0 { 0.5 * libm::atan2(p2, p0 - p1) } else { 0.0 };
        let azimuth = if azimuth < 0.0 { azimuth + std::f64::consts::PI } else { azimuth };
        Some(Shape { centre, apex_z_m, semiaxes_m, azimuth })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn shape_and_coefficients_are_one(
            x in -5.0f64..5.0, y in -5.0f64..5.0, z in 0.0f64..40.0,
            small in 0.3f64..2.0, more in 0.05f64..2.0, azimuth in 0.01f64..3.13,
        ) {
            let shape = Shape { centre: [x, y], apex_z_m: z, semiaxes_m: [small + more, small], azimuth };
            let back = Paraboloid::from_shape(&shape).shape().unwrap();
            let near = |a: f64, b: f64| (a - b).abs() < 1e-7;
            prop_assert!(near(back.centre[0], x) && near(back.centre[1], y) && near(back.apex_z_m, z));
            prop_assert!(near(back.semiaxes_m[0], small + more) && near(back.semiaxes_m[1], small));
            prop_assert!(near(back.azimuth, azimuth), "{} {}", back.azimuth, azimuth);
        }
    }

    #[test]
    fn equal_axes_have_no_direction() {
        let shape = Shape { centre: [1.0, 2.0], apex_z_m: 9.0, semiaxes_m: [0.5; 2], azimuth: 0.0 };
        assert_eq!(Paraboloid::from_shape(&shape).shape().unwrap().azimuth, 0.0);
    }

    #[test]
    fn a_saddle_and_a_bowl_have_no_shape() {
        assert_eq!(Paraboloid { phi: [-1.0, 1.0, 0.0, 0.0, 0.0, 0.0] }.shape(), None);
        assert_eq!(Paraboloid { phi: [1.0, 1.0, 0.0, 0.0, 0.0, 0.0] }.shape(), None);
    }

    #[test]
    fn the_semiaxis_is_the_radius_one_metre_below() {
        let shape =
            Shape { centre: [0.0; 2], apex_z_m: 20.0, semiaxes_m: [1.5, 0.5], azimuth: 0.0 };
        let surface = Paraboloid::from_shape(&shape);
        assert!((surface.z(1.5, 0.0) - 19.0).abs() < 1e-12);
        assert!((surface.z(0.0, 0.5) - 19.0).abs() < 1e-12);
    }
}
