//! One patch of the terrain model: a multiquadric surface over the nodes around a world-fixed square.

use crate::Error;
use crate::hardy::{Hardy, Kernel, Sample, Trend};
use crate::nodes::{Cell, Nodes};
use crate::quadtree::{SUPPORT_MARGIN, weight};
use std::collections::BTreeSet;
use timberline_pointcloud::frame::TICKS_PER_M;

/// The nodes of a patch in its own frame: the centre of the square, a whole-metre elevation.
#[derive(Debug, Clone, Default)]
pub struct PatchNodes {
    /// x minus the centre's, metres.
    pub x: Vec<f64>,
    /// y minus the centre's, metres.
    pub y: Vec<f64>,
    /// z minus the datum, metres.
    pub z: Vec<f64>,
    /// World elevation of the patch's zero, whole metres.
    pub datum_m: f64,
    /// Square root of the area per node, over the part of the neighbourhood that has nodes, metres.
    pub spacing_m: f64,
}

impl PatchNodes {
    /// Gathers the nodes of a square's neighbourhood. Where it holds fewer than `least`, the
    /// neighbourhood is widened by half the square's edge at a time, up to `reach_m` beyond the
    /// square, and thinned there: a lone square beside dense ground must not collect all of it.
    #[must_use]
    pub fn gather(nodes: &Nodes, cell: Cell, least: usize, reach_m: f64) -> Self {
        let within = |margin_m: f64| {
            let mut found = Vec::new();
            nodes.around(cell, margin_m, |index| found.push(index));
            found
        };
        let step = 0.5 * cell.edge_m();
        let mut margin = SUPPORT_MARGIN * cell.edge_m();
        let near = within(margin);
        let mut wide = Vec::new();
        while near.len().max(wide.len()) < least && margin + step <= reach_m {
            margin += step;
            wide = within(margin);
        }
        if wide.len() > least {
            wide = thinned(nodes, cell, near, &wide);
        } else if wide.is_empty() {
            wide = near;
        }
        Self::of(nodes, cell, &wide, margin)
    }

    fn of(nodes: &Nodes, cell: Cell, found: &[usize], margin_m: f64) -> Self {
        let half = TICKS_PER_M * cell.edge_m();
        let centre = [cell.ix, cell.iy].map(|i| ((2 * i + 1) as f64 * half / 2.0) as i64);
        let datum = found.first().map_or(0, |&i| nodes.ticks(i)[2].div_euclid(TICKS_PER_M as i64));
        let column = |axis: usize, zero: i64| -> Vec<f64> {
            found.iter().map(|&i| (nodes.ticks(i)[axis] - zero) as f64 / TICKS_PER_M).collect()
        };
        let (x, y) = (column(0, centre[0]), column(1, centre[1]));
        let z = column(2, datum * TICKS_PER_M as i64);
        let spacing_m = spacing(&x, &y, cell.edge_m(), margin_m);
        Self { x, y, z, datum_m: datum as f64, spacing_m }
    }

    /// The nodes as a sample for fitting.
    #[must_use]
    pub fn sample(&self) -> Sample<'_> {
        Sample { x: &self.x, y: &self.y, z: &self.z }
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }
}

/// Square root of the area per node. The neighbourhood is divided into 8 × 8 squares; those without
/// any node within themselves and their eight neighbours do not count (campaign borders, lakes).
fn spacing(x: &[f64], y: &[f64], edge_m: f64, margin_m: f64) -> f64 {
    const SIDE: usize = 8;
    let width = edge_m + 2.0 * margin_m;
    let place = |v: f64| (((v / width + 0.5) * SIDE as f64) as usize).min(SIDE - 1);
    let mut occupied = [[false; SIDE]; SIDE];
    for (x, y) in x.iter().zip(y) {
        let (column, row) = (place(*x), place(*y));
        for row in occupied.iter_mut().take(row + 2).skip(row.saturating_sub(1)) {
            row[column.saturating_sub(1)..(column + 2).min(SIDE)].fill(true);
        }
    }
    let share = occupied.iter().flatten().filter(|o| **o).count() as f64 / (SIDE * SIDE) as f64;
    let area = width * width * share;
    (area / x.len().max(1) as f64).sqrt()
}

/// Squares to an edge of a patch in which one far node is enough.
const FAR_SQUARES: i64 = 8;
/// So many far nodes are enough: a few rows of those squares.
const MOST_FAR_NODES: usize = 64;

/// The few `near` nodes (the surface must pass through them), and of those `found` beyond them one
/// per world-fixed square, the nearest to the patch first.
fn thinned(nodes: &Nodes, cell: Cell, near: Vec<usize>, found: &[usize]) -> Vec<usize> {
    let mut kept = near;
    let square = ((TICKS_PER_M * cell.edge_m()) as i64 / FAR_SQUARES).max(1);
    let centre = cell.centre();
    let mut seen = BTreeSet::new();
    let mut far: Vec<(f64, usize)> = Vec::new();
    for &index in found.iter().filter(|index| !kept.contains(index)) {
        let [x, y, _] = nodes.ticks(index);
        if seen.insert([x.div_euclid(square), y.div_euclid(square)]) {
            let [x, y, _] = nodes.world(index);
            let (dx, dy) = (x - centre[0], y - centre[1]);
            far.push((dx * dx + dy * dy, index));
        }
    }
    far.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    kept.extend(far.into_iter().take(MOST_FAR_NODES).map(|(_, index)| index));
    kept.sort_unstable();
    kept
}

/// A fitted patch.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// The world-fixed square in the middle.
    pub cell: Cell,
    /// World elevation of the surface's zero, whole metres.
    pub datum_m: f64,
    /// The surface in the frame of the square's centre.
    pub surface: Hardy,
}

impl Patch {
    /// Fits a surface to gathered nodes.
    ///
    /// # Errors
    /// As [`Hardy::fit`].
    pub fn fit(cell: Cell, nodes: &PatchNodes, kernel: Kernel) -> Result<Self, Error> {
        let surface = Hardy::fit(nodes.sample(), kernel, Trend::Plane)?;
        Ok(Self { cell, datum_m: nodes.datum_m, surface })
    }

    /// Weight and world elevation at a world position; `None` where the patch has no weight.
    #[must_use]
    pub fn at(&self, world: [f64; 2]) -> Option<(f64, f64)> {
        let centre = self.cell.centre();
        let (dx, dy) = (world[0] - centre[0], world[1] - centre[1]);
        let weight = weight(self.cell.edge_m(), dx, dy);
        (weight > 0.0).then(|| (weight, self.datum_m + self.surface.at(dx, dy)))
    }

    /// Whether a node lies within a distance of a world position.
    #[must_use]
    pub fn has_node(&self, world: [f64; 2], distance_m: f64) -> bool {
        let centre = self.cell.centre();
        let (x, y) = (world[0] - centre[0], world[1] - centre[1]);
        self.surface.x.iter().zip(&self.surface.y).any(|(node_x, node_y)| {
            let (dx, dy) = (node_x - x, node_y - y);
            dx * dx + dy * dy <= distance_m * distance_m
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lone_square_beside_dense_ground_stays_small() {
        let place = |i: i32| [20.0 + f64::from(i % 200) * 0.15, f64::from(i / 200) * 0.15, 1.0];
        let nodes = Nodes::new((0..20_000).map(place), 0.0);
        let gathered = PatchNodes::gather(&nodes, Cell::at(4, [-1.0, 1.0]), 16, 32.0);
        assert!((1..=16 + MOST_FAR_NODES).contains(&gathered.len()), "{}", gathered.len());
    }
}
