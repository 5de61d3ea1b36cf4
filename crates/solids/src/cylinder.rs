//! Finite circular cylinders.

use crate::bvh::Box3;
use crate::vector::{along, distance, dot, sub, unit};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A finite circular cylinder, closed by a disc at either end.
///
/// One without length has no axis and is taken as the ball around its start.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cylinder {
    /// Centre of the first end, m.
    pub start_m: [f64; 3],
    /// Centre of the second end, m.
    pub end_m: [f64; 3],
    /// Radius, m.
    pub radius_m: f64,
}

/// The ends of a cylinder that are closed by a disc. The others lie inside another body and have no
/// surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Ends {
    /// The disc around the start.
    pub start: bool,
    /// The disc around the end.
    pub end: bool,
}

impl Ends {
    /// A disc at either end.
    pub const BOTH: Self = Self { start: true, end: true };
    /// No disc: the lateral surface alone.
    pub const NONE: Self = Self { start: false, end: false };
}

impl Cylinder {
    /// Whether all its values are finite and the radius is not negative.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let values = self.start_m.iter().chain(&self.end_m).chain([&self.radius_m]);
        values.into_iter().all(|value| value.is_finite()) && self.radius_m >= 0.0
    }

    /// Direction from start to end, of length 1; none for a cylinder without length.
    #[must_use]
    pub fn axis(&self) -> Option<[f64; 3]> {
        unit(sub(self.end_m, self.start_m))
    }

    /// Distance between the ends, m.
    #[must_use]
    pub fn length_m(&self) -> f64 {
        distance(self.start_m, self.end_m)
    }

    /// Volume, m3.
    #[must_use]
    pub fn volume_m3(&self) -> f64 {
        PI * self.radius_m * self.radius_m * self.length_m()
    }

    /// Area of the surface without the discs, m2.
    #[must_use]
    pub fn lateral_area_m2(&self) -> f64 {
        2.0 * PI * self.radius_m * self.length_m()
    }

    /// Where a position is along the axis, counted from the start, and how far it is from the axis, m.
    #[must_use]
    pub fn along_and_across_m(&self, position_m: [f64; 3]) -> (f64, f64) {
        let offset = sub(position_m, self.start_m);
        let Some(axis) = self.axis() else {
            return (0.0, dot(offset, offset).sqrt());
        };
        let along_m = dot(offset, axis);
        let across = along(offset, axis, -along_m);
        (along_m, dot(across, across).sqrt())
    }

    /// Distance from a position to the closed surface, m, never negative.
    #[must_use]
    pub fn distance_m(&self, position_m: [f64; 3]) -> f64 {
        self.signed_distance_m(position_m).abs()
    }

    /// Distance from a position to the closed surface, m, negative inside.
    #[must_use]
    pub fn signed_distance_m(&self, position_m: [f64; 3]) -> f64 {
        let (along_m, across_m) = self.along_and_across_m(position_m);
        let length_m = self.length_m();
        let outwards = across_m - self.radius_m;
        if length_m <= 0.0 {
            return outwards;
        }
        let beyond = (-along_m).max(along_m - length_m);
        if outwards <= 0.0 || beyond <= 0.0 {
            return outwards.max(beyond);
        }
        (outwards * outwards + beyond * beyond).sqrt()
    }

    /// Distance from a position to the lateral surface and to those discs that count, m.
    #[must_use]
    pub fn distance_to_m(&self, position_m: [f64; 3], ends: Ends) -> f64 {
        let (along_m, across_m) = self.along_and_across_m(position_m);
        let length_m = self.length_m();
        let outwards = across_m - self.radius_m;
        let beyond = (-along_m).max(along_m - length_m).max(0.0);
        let mut squared = outwards * outwards + beyond * beyond;
        // Over a disc the way to it is straight; beside it the rim is nearest, and part of both.
        for (closed, at_m) in [(ends.start, 0.0), (ends.end, length_m)] {
            if closed && length_m > 0.0 && outwards < 0.0 {
                squared = squared.min((along_m - at_m) * (along_m - at_m));
            }
        }
        squared.sqrt()
    }

    /// The smallest box around it.
    #[must_use]
    pub(crate) fn bounds(&self) -> Box3 {
        let axis = self.axis();
        let mut bounds = Box3::EMPTY;
        for (place, (start, end)) in self.start_m.into_iter().zip(self.end_m).enumerate() {
            let across = axis.map_or(1.0, |axis| (1.0 - axis[place] * axis[place]).max(0.0).sqrt());
            let reach = self.radius_m * across;
            bounds.min[place] = start.min(end) - reach;
            bounds.max[place] = start.max(end) + reach;
        }
        bounds
    }
}

/// The ends that are part of the surface of a branching chain of cylinders: the start where there is no
/// parent, the end unless a child begins within its disc. `parents` holds places in `cylinders`.
#[must_use]
pub fn free_ends(cylinders: &[Cylinder], parents: &[Option<u32>]) -> Vec<Ends> {
    let mut ends: Vec<Ends> = (0..cylinders.len())
        .map(|place| Ends { start: parents.get(place).is_none_or(Option::is_none), end: true })
        .collect();
    for (child, parent) in cylinders.iter().zip(parents) {
        let Some(place) = parent.map(|parent| parent as usize) else { continue };
        let Some(parent) = cylinders.get(place) else { continue };
        if distance(child.start_m, parent.end_m) <= parent.radius_m.max(child.radius_m) {
            ends[place].end = false;
        }
    }
    ends
}

#[cfg(test)]
mod tests;
