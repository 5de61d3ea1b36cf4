//! Axis-parallel boxes.

use serde::{Deserialize, Serialize};

/// A box in three dimensions, closed on all sides. Empty when a minimum exceeds its maximum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bounds3 {
    /// Smallest coordinates.
    pub min: [f64; 3],
    /// Largest coordinates.
    pub max: [f64; 3],
}

impl Bounds3 {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

    /// Whether the box holds nothing.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        (0..3).any(|axis| self.min[axis] > self.max[axis])
    }

    /// Grows the box to hold a position.
    pub fn include(&mut self, position: [f64; 3]) {
        for axis in 0..3 {
            self.min[axis] = self.min[axis].min(position[axis]);
            self.max[axis] = self.max[axis].max(position[axis]);
        }
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// The footprint in the plane.
    #[must_use]
    pub fn rect(&self) -> Rect {
        Rect { min: [self.min[0], self.min[1]], max: [self.max[0], self.max[1]] }
    }
}

/// A rectangle in the plane. As a tile or cell it is half-open: its upper edges belong to the next one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rect {
    /// Smallest x and y.
    pub min: [f64; 2],
    /// Largest x and y.
    pub max: [f64; 2],
}

impl Rect {
    /// The rectangle that holds nothing.
    pub const EMPTY: Self = Self { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    /// Whether a position lies inside, the lower edges included, the upper ones not.
    #[must_use]
    pub fn contains(&self, x: f64, y: f64) -> bool {
        x >= self.min[0] && x < self.max[0] && y >= self.min[1] && y < self.max[1]
    }

    /// Whether the rectangles share a position when both are taken as closed.
    #[must_use]
    pub fn touches(&self, other: &Self) -> bool {
        (0..2).all(|axis| self.min[axis] <= other.max[axis] && other.min[axis] <= self.max[axis])
    }

    /// The rectangle grown by a margin on all sides.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self {
            min: self.min.map(|value| value - margin),
            max: self.max.map(|value| value + margin),
        }
    }

    /// The rectangle moved.
    #[must_use]
    pub fn moved(&self, by: [f64; 2]) -> Self {
        let add = |corner: [f64; 2]| [corner[0] + by[0], corner[1] + by[1]];
        Self { min: add(self.min), max: add(self.max) }
    }

    /// Smallest rectangle holding both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
        }
    }

    /// Squared distance from a position to the rectangle; 0 inside.
    #[must_use]
    pub fn squared_distance(&self, x: f64, y: f64) -> f64 {
        let dx = (self.min[0] - x).max(x - self.max[0]).max(0.0);
        let dy = (self.min[1] - y).max(y - self.max[1]).max(0.0);
        dx * dx + dy * dy
    }

    /// Width and height.
    #[must_use]
    pub fn size(&self) -> [f64; 2] {
        [self.max[0] - self.min[0], self.max[1] - self.min[1]]
    }
}

impl Default for Rect {
    fn default() -> Self {
        Self::EMPTY
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_open() {
        let rect = Rect { min: [0.0, 0.0], max: [2.0, 2.0] };
        assert!(rect.contains(0.0, 0.0) && !rect.contains(2.0, 1.0));
        assert_eq!(rect.squared_distance(5.0, 6.0), 25.0);
    }

    #[test]
    fn union_of_nothing_is_nothing() {
        assert!(Bounds3::EMPTY.union(&Bounds3::EMPTY).is_empty());
    }
}
