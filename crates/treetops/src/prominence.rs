//! How far a top stands out from the crown surface around it.
//!
//! As with mountains: on the way from a top to anything that ranks higher one must descend; the
//! prominence is the least descent. The way leads over the highest points of world-fixed cells of
//! half a metre, through the eight neighbours of each, within a disc around the top. A cell without
//! points is as high as its neighbours in the mean, or as the ground where these are empty too.
//! A top with nothing higher in its disc has its height above ground as prominence. Since the disc
//! bounds it, the value depends on the points near the top only, never on the tile.
//!
//! Two maxima of one crown are parted by the roughness of its surface, two crowns by a gap: this is
//! what tells them apart where a window fit for the largest crown would swallow small trees.

use crate::maxima::{CELL_TICKS, Surface};
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use timberline_pointcloud::frame::TICK_M;

/// Edge of the cells of the surface, metres.
pub const SURFACE_CELL_M: f64 = CELL_TICKS as f64 * TICK_M;

/// How far from a top its prominence can depend on points: the reach, rounded up to whole cells,
/// the cell of the top, and one more around the disc from which empty cells are filled.
#[must_use]
pub fn halo_m(reach_m: f64) -> f64 {
    f64::from(reach_cells(reach_m) + 2) * SURFACE_CELL_M * std::f64::consts::SQRT_2
}

fn reach_cells(reach_m: f64) -> i32 {
    (reach_m / SURFACE_CELL_M).ceil() as i32
}

/// A square cut-out of the surface around a top.
struct Patch {
    /// Cells from the centre to the border of the disc.
    radius: i32,
    /// Cells along an edge: the disc and one more on each side.
    width: usize,
    /// How far each cell's highest point lies above the top (mostly below: negative), row by row.
    /// Differences are the same bits in any frame; elevations are not.
    values: Vec<Option<f64>>,
    /// Whether it outranks the top.
    is_higher: Vec<bool>,
    /// The ground at the top, seen from it.
    floor: f64,
}

impl Patch {
    fn cut(surface: &Surface<'_>, top: usize) -> Self {
        let ranked = &surface.ranked;
        let radius = reach_cells(ranked.params.prominence_reach_m);
        let width = (2 * radius + 3) as usize;
        let floor = -ranked.height(top);
        let (values, is_higher) = (vec![None; width * width], vec![false; width * width]);
        let mut patch = Self { radius, width, values, is_higher, floor };
        let [column, row] = surface.cells.cell_at(ranked.input.cloud.world(top));
        let (low, high) = (row - radius - 1, row + radius + 1);
        for at in 0..width {
            for place in surface.cells.run(column - radius - 1 + at as i32, low, high) {
                let slot = (surface.cells.row(place) - low) as usize * width + at;
                if let Some(best) = surface.best[place].map(|best| best as usize) {
                    patch.values[slot] = Some(ranked.value(best) - ranked.value(top));
                    patch.is_higher[slot] = ranked.outranks(best, top);
                }
            }
        }
        patch
    }

    fn centre(&self) -> usize {
        self.width * self.width / 2
    }

    /// Whether a cell lies in the disc.
    fn is_inside(&self, slot: usize) -> bool {
        let away = |place: usize| place as i32 - self.radius - 1;
        let (dx, dy) = (away(slot % self.width), away(slot / self.width));
        dx * dx + dy * dy <= self.radius * self.radius
    }

    fn neighbours(&self, slot: usize) -> [usize; 8] {
        let w = self.width;
        [
            slot - w - 1,
            slot - w,
            slot - w + 1,
            slot - 1,
            slot + 1,
            slot + w - 1,
            slot + w,
            slot + w + 1,
        ]
    }

    /// Value of a cell of the disc, empty ones filled.
    fn value(&self, slot: usize) -> f64 {
        self.values[slot].unwrap_or_else(|| {
            let around = self.neighbours(slot).into_iter().filter_map(|place| self.values[place]);
            let (sum, count) = around.fold((0.0, 0.0), |(s, n), value| (s + value, n + 1.0));
            if count > 0.0 { sum / count } else { self.floor }
        })
    }

    /// The highest level at which the top is joined to something higher; none if nothing is.
    fn col(&self) -> Option<f64> {
        let mut seen = vec![false; self.values.len()];
        let mut front = BinaryHeap::from([Front { level: 0.0, slot: self.centre() }]);
        seen[self.centre()] = true;
        while let Some(Front { level, slot }) = front.pop() {
            if self.is_higher[slot] {
                return Some(level);
            }
            for next in self.neighbours(slot) {
                if !seen[next] && self.is_inside(next) {
                    seen[next] = true;
                    front.push(Front { level: level.min(self.value(next)), slot: next });
                }
            }
        }
        None
    }
}

/// A cell at the edge of the flooded part and the level at which it is reached.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Front {
    level: f64,
    slot: usize,
}

impl Eq for Front {}

impl Ord for Front {
    fn cmp(&self, other: &Self) -> Ordering {
        self.level.total_cmp(&other.level).then(other.slot.cmp(&self.slot))
    }
}

impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Prominence of a point that is the highest of its cell, metres.
pub(crate) fn prominence(surface: &Surface<'_>, top: usize) -> f64 {
    Patch::cut(surface, top).col().map_or(surface.ranked.height(top), |col| -col)
}
