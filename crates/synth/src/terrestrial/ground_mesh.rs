//! Ground as heights on a fine lattice, which rays meet.

use super::vector::{Vec3, unit};
use timberline_pointcloud::{Bounds3, Rect};

/// Most steps of a ray towards the ground; grazing rays give up.
const MOST_STEPS: u32 = 400;
/// Smallest step, m.
const LEAST_STEP_M: f64 = 0.004;

/// Heights at the nodes of a square lattice, bilinear between them.
#[derive(Debug, Clone)]
pub(crate) struct GroundMesh {
    corner: [f64; 2],
    cell: f64,
    size: [usize; 2],
    heights: Vec<f64>,
    low: f64,
    high: f64,
    /// Steepest rise between neighbouring nodes, per metre, times the square root of 2.
    steepest: f64,
}

impl GroundMesh {
    /// Samples a surface over a rectangle of at least one cell.
    pub(crate) fn new(rect: &Rect, cell: f64, height: impl Fn(f64, f64) -> f64) -> Self {
        let size = rect.size().map(|edge| (edge / cell).ceil().max(1.0) as usize + 1);
        let at = |index: usize| {
            let x = rect.min[0] + (index % size[0]) as f64 * cell;
            height(x, rect.min[1] + (index / size[0]) as f64 * cell)
        };
        let heights: Vec<f64> = (0..size[0] * size[1]).map(at).collect();
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let rise = |a: usize, b: usize| (heights[b] - heights[a]).abs();
        let right =
            (0..heights.len()).filter(|i| i % size[0] + 1 < size[0]).map(|i| rise(i, i + 1));
        let up = (0..heights.len() - size[0]).map(|i| rise(i, i + size[0]));
        let steepest = right.chain(up).fold(0.0, f64::max) / cell * std::f64::consts::SQRT_2;
        Self { corner: rect.min, cell, size, heights, low, high, steepest }
    }

    pub(crate) fn bounds(&self) -> Bounds3 {
        let edge = |axis: usize| self.corner[axis] + (self.size[axis] - 1) as f64 * self.cell;
        Bounds3 {
            min: [self.corner[0], self.corner[1], self.low],
            max: [edge(0), edge(1), self.high],
        }
    }

    /// Height and gradient at a position within the lattice.
    pub(crate) fn surface(&self, x: f64, y: f64) -> (f64, [f64; 2]) {
        let place = |value: f64, axis: usize| {
            let cells = ((value - self.corner[axis]) / self.cell).max(0.0);
            let index = (cells as usize).min(self.size[axis] - 2);
            (index, (cells - index as f64).min(1.0))
        };
        let ((i, u), (j, v)) = (place(x, 0), place(y, 1));
        let first = j * self.size[0] + i;
        let [a, b] = [self.heights[first], self.heights[first + 1]];
        let [c, d] = [self.heights[first + self.size[0]], self.heights[first + self.size[0] + 1]];
        let height = a + u * (b - a) + v * (c - a) + u * v * (a - b - c + d);
        let gx = (b - a + v * (a - b - c + d)) / self.cell;
        let gy = (c - a + u * (a - b - c + d)) / self.cell;
        (height, [gx, gy])
    }

    /// Range and normal where a ray meets the ground from above, when nearer than `limit`.
    pub(crate) fn hit(&self, origin: Vec3, direction: Vec3, limit: f64) -> Option<(f64, Vec3)> {
        let (mut range, last) = self.span(origin, direction, limit)?;
        let level = libm::hypot(direction[0], direction[1]);
        let closing = (self.steepest * level - direction[2]).max(1e-6);
        let gap = |t: f64| {
            let [x, y, z] = super::vector::along(origin, direction, t);
            z - self.surface(x, y).0
        };
        let mut above = gap(range);
        if above < 0.0 {
            return None;
        }
        for _ in 0..MOST_STEPS {
            let next = range + (above / closing).max(LEAST_STEP_M);
            if next > last {
                return None;
            }
            let left = gap(next);
            if left <= 0.0 {
                let t = range + (next - range) * above / (above - left);
                let [x, y, _] = super::vector::along(origin, direction, t);
                let [gx, gy] = self.surface(x, y).1;
                return (t < limit).then(|| (t, unit([-gx, -gy, 1.0])));
            }
            (range, above) = (next, left);
        }
        None
    }

    /// The part of a ray over the lattice and not above its highest node.
    fn span(&self, origin: Vec3, direction: Vec3, limit: f64) -> Option<(f64, f64)> {
        let bounds = self.bounds();
        let (mut near, mut far) = (0.0_f64, limit);
        for axis in 0..3 {
            let inverse = 1.0 / direction[axis];
            let low = if axis == 2 { bounds.min[2] - 1.0 } else { bounds.min[axis] };
            let a = (low - origin[axis]) * inverse;
            let b = (bounds.max[axis] + 1e-9 - origin[axis]) * inverse;
            near = near.max(a.min(b));
            far = far.min(a.max(b));
        }
        (near <= far).then_some((near, far))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn hill() -> GroundMesh {
        let rect = Rect { min: [-10.0, -10.0], max: [10.0, 10.0] };
        GroundMesh::new(&rect, 0.1, |x, y| 0.2 * x + 0.3 * libm::sin(y) + 5.0)
    }

    proptest! {
        #[test]
        fn rays_end_on_the_surface(x in -6f64..6., y in -6f64..6., tilt in 0f64..1.2, turn in 0f64..6.3) {
            let (sin, cos) = libm::sincos(tilt);
            let direction = [sin * libm::cos(turn), sin * libm::sin(turn), -cos];
            let (mesh, origin) = (hill(), [x, y, 7.5]);
            let Some((range, normal)) = mesh.hit(origin, direction, 60.0) else { return Ok(()) };
            let [x, y, z] = super::super::vector::along(origin, direction, range);
            prop_assert!((z - mesh.surface(x, y).0).abs() < 2e-3);
            prop_assert!(super::super::vector::dot(normal, direction) < 0.0);
        }
    }

    #[test]
    fn rays_into_the_sky_and_beyond_the_edge_end_nowhere() {
        assert!(hill().hit([0.0, 0.0, 7.5], [0.0, 0.0, 1.0], 50.0).is_none());
        assert!(hill().hit([0.0, 0.0, 50.0], unit([3.0, 0.0, -1.0]), 500.0).is_none());
        assert!(hill().hit([0.0, 0.0, 7.0], [0.0, 0.0, -1.0], 1.0).is_none());
        let (range, _) = hill().hit([0.0, 0.0, 7.0], [0.0, 0.0, -1.0], 10.0).unwrap();
        assert!((range - 2.0).abs() < 1e-9);
    }
}
