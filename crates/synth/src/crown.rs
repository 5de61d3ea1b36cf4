//! The envelope of a crown: nothing of the tree's foliage lies outside.

use serde::{Deserialize, Serialize};

/// How fast a crown widens below its top.
///
/// With `rho` the distance from the axis over the crown radius in that direction, the upper surface
/// lies `upper_m * ((1 - round) (straight rho + (1 - straight) rho^2) + round (1 - sqrt(1 - rho^2)))`
/// below the top: cone, paraboloid, ellipsoid and all between. Below its widest place the crown
/// closes as half an ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Share of a cone in the part that is not ellipsoid; the rest is a paraboloid.
    pub straight: f64,
    /// Share of an ellipsoid.
    pub round: f64,
}

impl Profile {
    /// Depth of the upper surface below the top at a normalised distance from the axis, as a share
    /// of the crown's upper length; rises from 0 to 1.
    #[must_use]
    pub fn depth(&self, rho: f64) -> f64 {
        let blend = rho * (self.straight + (1.0 - self.straight) * rho);
        if self.round == 0.0 {
            return blend;
        }
        (1.0 - self.round) * blend + self.round * (1.0 - (1.0 - rho * rho).max(0.0).sqrt())
    }
}

/// The envelope of one crown, in the frame of its scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crown {
    /// The highest position, m.
    pub top_m: [f64; 3],
    /// Horizontal move of the crown's axis for every metre below the top.
    pub axis: [f64; 2],
    /// Semi-axes of the widest horizontal section, m, the longer one first.
    pub semi_axes_m: [f64; 2],
    /// Direction of the longer one: cosine and sine of the angle from east towards north.
    pub direction: [f64; 2],
    /// Vertical distance from the top to the widest section, m.
    pub upper_m: f64,
    /// Vertical distance from there to the crown's base, m.
    pub lower_m: f64,
    /// Form of the upper surface.
    pub profile: Profile,
}

impl Crown {
    /// Elevation of the crown's base, m.
    #[must_use]
    pub fn base_z_m(&self) -> f64 {
        self.top_m[2] - self.upper_m - self.lower_m
    }

    /// Position of the crown's axis at a depth below the top.
    #[must_use]
    pub fn centre_m(&self, depth_m: f64) -> [f64; 2] {
        [self.top_m[0] + self.axis[0] * depth_m, self.top_m[1] + self.axis[1] * depth_m]
    }

    /// Horizontal offset from the axis in units of the semi-axes, given in metres.
    #[must_use]
    pub fn normalised(&self, dx_m: f64, dy_m: f64) -> [f64; 2] {
        let [cos, sin] = self.direction;
        [
            (cos * dx_m + sin * dy_m) / self.semi_axes_m[0],
            (cos * dy_m - sin * dx_m) / self.semi_axes_m[1],
        ]
    }

    /// Position of a place on the upper surface given by its normalised offset.
    #[must_use]
    pub fn on_surface_m(&self, u: f64, v: f64) -> [f64; 3] {
        let depth = self.upper_m * self.profile.depth((u * u + v * v).sqrt());
        let [cx, cy] = self.centre_m(depth);
        let ([a, b], [cos, sin]) = (self.semi_axes_m, self.direction);
        let (along, across) = (u * a, v * b);
        [cx + cos * along - sin * across, cy + sin * along + cos * across, self.top_m[2] - depth]
    }

    /// Whether a position is inside an envelope widened by a margin in metres on all sides.
    #[must_use]
    pub fn contains(&self, position_m: [f64; 3], margin_m: f64) -> bool {
        let depth = self.top_m[2] - position_m[2];
        if depth < -margin_m || depth > self.upper_m + self.lower_m + margin_m {
            return false;
        }
        let [cx, cy] = self.centre_m(depth);
        let (dx, dy) = (position_m[0] - cx, position_m[1] - cy);
        let [u, v] = self.normalised(dx, dy);
        let [a, b] = self.semi_axes_m;
        let rho = ((u * u + v * v).sqrt() - margin_m / a.min(b)).max(0.0);
        let down = depth + margin_m;
        if rho >= 1.0 {
            false
        } else if down <= self.upper_m {
            self.upper_m * self.profile.depth(rho) <= down
        } else {
            depth - margin_m - self.upper_m <= self.lower_m * (1.0 - rho * rho).sqrt()
        }
    }

    /// Elevation of the upper surface over a position of the plane, m; none beside the crown.
    ///
    /// The lean makes this a fixed point, found by ten rounds of substitution: exact to well below
    /// a millimetre except within a few centimetres of the rim of a rounded crown.
    #[must_use]
    pub fn surface_z_m(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let mut depth = 0.5 * self.upper_m;
        let mut rho = 0.0;
        for _ in 0..10 {
            let [cx, cy] = self.centre_m(depth);
            let [u, v] = self.normalised(x_m - cx, y_m - cy);
            rho = (u * u + v * v).sqrt();
            depth = self.upper_m * self.profile.depth(rho.min(1.0));
        }
        (rho < 1.0).then(|| self.top_m[2] - depth)
    }

    /// Whether a position of the plane is near enough for [`Self::surface_z_m`] to be worth asking.
    pub(crate) fn may_cover(&self, x_m: f64, y_m: f64) -> bool {
        let half = 0.5 * self.upper_m;
        let [cx, cy] = self.centre_m(half);
        let reach = self.semi_axes_m[0] + half * (self.axis[0].abs() + self.axis[1].abs());
        let (dx, dy) = (x_m - cx, y_m - cy);
        dx * dx + dy * dy < reach * reach
    }

    /// Centre of the widest section, m.
    #[must_use]
    pub fn widest_centre_m(&self) -> [f64; 2] {
        self.centre_m(self.upper_m)
    }

    /// Area of the widest section, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        std::f64::consts::PI * self.semi_axes_m[0] * self.semi_axes_m[1]
    }

    /// Radius of the circle with the area of the widest section, m.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        (self.semi_axes_m[0] * self.semi_axes_m[1]).sqrt()
    }

    /// Angle of the longer semi-axis from east towards north, degrees in [0, 180).
    #[must_use]
    pub fn azimuth_deg(&self) -> f64 {
        let angle = libm::atan2(self.direction[1], self.direction[0]).to_degrees();
        if angle < 0.0 {
            angle + 180.0
        } else if angle >= 180.0 {
            angle - 180.0
        } else {
            angle
        }
    }

    /// Smallest and largest x and y that any part of the crown or the line down to `base` reaches.
    pub(crate) fn reach_m(&self, base: [f64; 2]) -> ([f64; 2], [f64; 2]) {
        let radius = self.semi_axes_m[0];
        let low = self.centre_m(self.upper_m + self.lower_m);
        let bounds = |axis: usize| {
            let (a, b) = (self.top_m[axis], low[axis]);
            (a.min(b).min(base[axis] + radius) - radius, a.max(b).max(base[axis] - radius) + radius)
        };
        let ((x0, x1), (y0, y1)) = (bounds(0), bounds(1));
        ([x0, y0], [x1, y1])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub(crate) fn leaning() -> Crown {
        Crown {
            top_m: [10.0, -4.0, 130.0],
            axis: [0.05, -0.02],
            semi_axes_m: [3.0, 2.4],
            direction: [0.8, 0.6],
            upper_m: 9.0,
            lower_m: 1.5,
            profile: Profile { straight: 0.7, round: 0.2 },
        }
    }

    proptest! {
        #[test]
        fn the_surface_bounds_the_inside(u in -0.9f64..0.9, v in -0.4f64..0.4) {
            let crown = leaning();
            let [x, y, z] = crown.on_surface_m(u, v);
            prop_assert!(z <= crown.top_m[2]);
            prop_assert!((crown.surface_z_m(x, y).unwrap() - z).abs() < 2e-3);
            prop_assert!(crown.contains([x, y, z - 0.01], 0.0));
            prop_assert!(!crown.contains([x, y, z + 0.01], 0.0));
            prop_assert!(crown.contains([x, y, z + 0.01], 0.1));
        }

        #[test]
        fn profiles_rise_from_nought_to_one(straight in 0f64..1., round in 0f64..1., rho in 0f64..0.99) {
            let profile = Profile { straight, round };
            prop_assert_eq!(profile.depth(0.0), 0.0);
            prop_assert!((profile.depth(1.0) - 1.0).abs() < 1e-12);
            prop_assert!(profile.depth(rho) <= profile.depth(rho + 0.01));
        }
    }

    #[test]
    fn the_top_is_the_top() {
        let crown = leaning();
        assert_eq!(crown.on_surface_m(0.0, 0.0), crown.top_m);
        assert!(crown.contains(crown.top_m, 0.0));
    }
}
