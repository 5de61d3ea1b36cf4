//! The pieces of wood: truncated cones, with exact volume, distance and intersection.

use super::vector::{Vec3, across, add, along, dot, length, scale, sub, unit};
use serde::{Deserialize, Serialize};
use timberline_pointcloud::Bounds3;

/// A piece of wood between two positions: a truncated cone with circular ends across its axis.
///
/// Pieces of one branch follow each other: the end of one is the start of the next. Where the
/// direction changes, the wedge between the two is filled by a ball that nowhere stands out.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrueCylinder {
    /// Number in the tree: the index in [`super::TreeModel::cylinders`].
    pub id: u32,
    /// The piece that this one starts on; `None` at the foot of the stem. Always a smaller number.
    pub parent: Option<u32>,
    /// Number of the branch it belongs to; 0 is the stem.
    pub branch: u32,
    /// Order of the branch: 0 for the stem, one more than the branch it starts on otherwise.
    pub order: u8,
    /// Where the axis starts, world, m.
    pub start_m: [f64; 3],
    /// Where the axis ends, world, m.
    pub end_m: [f64; 3],
    /// Radius at the start, m.
    pub start_radius_m: f64,
    /// Radius at the end, m.
    pub end_radius_m: f64,
}

impl TrueCylinder {
    /// Length of the axis, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        length(sub(self.end_m, self.start_m))
    }

    /// Volume of the truncated cone, m³.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        let (a, b) = (self.start_radius_m, self.end_radius_m);
        std::f64::consts::PI / 3.0 * self.length_m() * (a * a + a * b + b * b)
    }

    /// Area of the side, m².
    #[must_use]
    pub fn side_m2(&self) -> f64 {
        let (a, b) = (self.start_radius_m, self.end_radius_m);
        let slant = libm::hypot(self.length_m(), a - b);
        std::f64::consts::PI * (a + b) * slant
    }

    /// Mean of the diameters at both ends, m.
    #[must_use]
    pub fn mean_diameter_m(&self) -> f64 {
        self.start_radius_m + self.end_radius_m
    }

    /// Unit vector from start to end.
    #[must_use]
    pub fn direction(&self) -> [f64; 3] {
        unit(sub(self.end_m, self.start_m))
    }

    pub(crate) fn moved(mut self, shift_m: Vec3) -> Self {
        self.start_m = add(self.start_m, shift_m);
        self.end_m = add(self.end_m, shift_m);
        self
    }
}

/// What closes the end of a piece.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Joint {
    /// It lies within other wood.
    Buried,
    /// A disc: the cut of a stem, the tip of a twig.
    Flat,
    /// A ball, as the next piece goes elsewhere.
    Ball,
}

/// A piece of wood prepared for distances and rays, in the frame of the piece's positions.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Solid {
    start: Vec3,
    axis: Vec3,
    length: f64,
    radius: [f64; 2],
    ends: [Joint; 2],
    /// Sine and cosine of the angle between side and axis; positive when it tapers.
    taper: [f64; 2],
}

impl Solid {
    pub(crate) fn new(piece: &TrueCylinder, ends: [Joint; 2]) -> Self {
        let way = sub(piece.end_m, piece.start_m);
        let length = length(way);
        let radius = [piece.start_radius_m, piece.end_radius_m];
        let slant = libm::hypot(length, radius[0] - radius[1]).max(1e-12);
        let taper = [(radius[0] - radius[1]) / slant, length / slant];
        Self { start: piece.start_m, axis: unit(way), length, radius, ends, taper }
    }

    pub(crate) fn bounds(&self) -> Bounds3 {
        let end = along(self.start, self.axis, self.length);
        let mut bounds = Bounds3::EMPTY;
        for (centre, radius) in [(self.start, self.radius[0]), (end, self.radius[1])] {
            bounds.include(centre.map(|value| value - radius));
            bounds.include(centre.map(|value| value + radius));
        }
        bounds
    }

    /// Radius of the ball at an end: the largest that the cone holds.
    fn ball(&self, end: usize) -> f64 {
        self.radius[end] * self.taper[1]
    }

    /// Signed distance to the surface, negative within the wood. Buried ends and those with a ball
    /// are no surface.
    pub(crate) fn signed_distance_m(&self, point: Vec3) -> f64 {
        let from = sub(point, self.start);
        let u = dot(from, self.axis);
        let v = (dot(from, from) - u * u).max(0.0).sqrt();
        let mut distance = self.in_profile(u, v);
        for (end, at) in [(0, 0.0), (1, self.length)] {
            if self.ends[end] == Joint::Ball {
                distance = distance.min(libm::hypot(u - at, v) - self.ball(end));
            }
        }
        distance
    }

    /// Signed distance in the half-plane of axis position `u` and distance from the axis `v`.
    fn in_profile(&self, u: f64, v: f64) -> f64 {
        let [sin, cos] = self.taper;
        let [r0, r1] = self.radius;
        let side = u * sin + (v - r0) * cos;
        if side <= 0.0 && (0.0..=self.length).contains(&u) {
            let mut depth = side;
            for (end, cap) in [(0, -u), (1, u - self.length)] {
                if self.ends[end] == Joint::Flat {
                    depth = depth.max(cap);
                }
            }
            return depth;
        }
        let slant = libm::hypot(self.length, r0 - r1);
        let s = (u * cos - (v - r0) * sin).clamp(0.0, slant);
        let mut distance = libm::hypot(u - s * cos, v - (r0 - s * sin));
        for (at, radius) in [(0.0, r0), (self.length, r1)] {
            distance = distance.min(libm::hypot(u - at, (v - radius).max(0.0)));
        }
        distance
    }

    /// Range and outward normal where a ray enters, when nearer than `limit`.
    pub(crate) fn hit(&self, origin: Vec3, direction: Vec3, limit: f64) -> Option<(f64, Vec3)> {
        let mut best = self.side_hit(origin, direction).filter(|hit| hit.0 < limit);
        for end in 0..2 {
            let found = match self.ends[end] {
                Joint::Buried => None,
                Joint::Flat => self.cap_hit(origin, direction, end),
                Joint::Ball => self.ball_hit(origin, direction, end),
            };
            let nearest = best.map_or(limit, |hit| hit.0);
            best = found.filter(|hit| hit.0 < nearest).or(best);
        }
        best
    }

    fn side_hit(&self, origin: Vec3, direction: Vec3) -> Option<(f64, Vec3)> {
        let from = sub(origin, self.start);
        let (du, ou) = (dot(direction, self.axis), dot(from, self.axis));
        let d = along(direction, self.axis, -du);
        let o = along(from, self.axis, -ou);
        // |o + t d| = r0 + k (ou + t du), with k the change of radius along the axis.
        let k = (self.radius[1] - self.radius[0]) / self.length.max(1e-12);
        let (rise, base) = (k * du, self.radius[0] + k * ou);
        let a = dot(d, d) - rise * rise;
        let b = dot(o, d) - base * rise;
        let c = dot(o, o) - base * base;
        let root = b * b - a * c;
        if root < 0.0 || a.abs() < 1e-14 {
            return None;
        }
        let root = root.sqrt();
        let times = if a > 0.0 {
            [(-b - root) / a, (-b + root) / a]
        } else {
            [(-b + root) / a, (-b - root) / a]
        };
        let [sin, cos] = self.taper;
        times.into_iter().filter(|&t| t > 0.0).find_map(|t| {
            let u = ou + t * du;
            let outward = along(o, d, t);
            let normal = along(scale(unit(outward), cos), self.axis, sin);
            let inside = (0.0..=self.length).contains(&u) && base + t * rise >= 0.0;
            (inside && dot(normal, direction) < 0.0).then_some((t, normal))
        })
    }

    fn cap_hit(&self, origin: Vec3, direction: Vec3, end: usize) -> Option<(f64, Vec3)> {
        let normal = scale(self.axis, if end == 0 { -1.0 } else { 1.0 });
        let closing = dot(direction, normal);
        if closing >= 0.0 {
            return None;
        }
        let centre = along(self.start, self.axis, self.length * end as f64);
        let t = dot(sub(centre, origin), normal) / closing;
        let off = sub(along(origin, direction, t), centre);
        let within = dot(off, off) <= self.radius[end] * self.radius[end];
        (t > 0.0 && within).then_some((t, normal))
    }

    fn ball_hit(&self, origin: Vec3, direction: Vec3, end: usize) -> Option<(f64, Vec3)> {
        let centre = along(self.start, self.axis, self.length * end as f64);
        let from = sub(origin, centre);
        let (b, radius) = (dot(from, direction), self.ball(end));
        let root = b * b - dot(from, from) + radius * radius;
        let t = -b - root.max(0.0).sqrt();
        (root > 0.0 && t > 0.0).then(|| (t, unit(along(from, direction, t))))
    }
}

/// A leaf, or a spray of needles: an ellipse that is hit from both sides.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Leaf {
    /// Centre, world, m.
    pub centre_m: [f64; 3],
    /// Unit vector along the longer axis.
    pub along: [f64; 3],
    /// Unit vector across the blade.
    pub normal: [f64; 3],
    /// Half of the length and half of the width, m.
    pub half_m: [f64; 2],
}

impl Leaf {
    /// Area of one side, m².
    #[must_use]
    pub fn area_m2(&self) -> f64 {
        std::f64::consts::PI * self.half_m[0] * self.half_m[1]
    }

    pub(crate) fn bounds(&self) -> Bounds3 {
        let side = super::vector::cross(self.normal, self.along);
        let reach: Vec3 = std::array::from_fn(|i| {
            libm::hypot(self.half_m[0] * self.along[i], self.half_m[1] * side[i])
        });
        Bounds3 { min: sub(self.centre_m, reach), max: add(self.centre_m, reach) }
    }

    /// Range and the side's normal where a ray meets it, when nearer than `limit`.
    pub(crate) fn hit(&self, origin: Vec3, direction: Vec3, limit: f64) -> Option<(f64, Vec3)> {
        let closing = dot(direction, self.normal);
        if closing.abs() < 1e-9 {
            return None;
        }
        let t = dot(sub(self.centre_m, origin), self.normal) / closing;
        if t <= 0.0 || t >= limit {
            return None;
        }
        let off = sub(along(origin, direction, t), self.centre_m);
        let p = dot(off, self.along) / self.half_m[0];
        let side = dot(off, off) - (p * self.half_m[0]) * (p * self.half_m[0]);
        let within = p * p + side / (self.half_m[1] * self.half_m[1]) <= 1.0;
        within.then(|| (t, scale(self.normal, -closing.signum())))
    }

    pub(crate) fn moved(mut self, shift_m: Vec3) -> Self {
        self.centre_m = add(self.centre_m, shift_m);
        self
    }
}

/// A leaf at a position, its blade across `normal`, its length turned towards `tip`.
pub(crate) fn leaf(centre_m: Vec3, normal: Vec3, tip: Vec3, half_m: [f64; 2]) -> Leaf {
    let normal = unit(normal);
    let flat = along(tip, normal, -dot(tip, normal));
    let along = if length(flat) > 1e-6 { unit(flat) } else { across(normal)[0] };
    Leaf { centre_m, along, normal, half_m }
}

#[cfg(test)]
#[path = "cylinder/tests.rs"]
mod tests;
