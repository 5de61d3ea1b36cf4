//! Ground points as nodes of the terrain model: merged where too close, sorted along the world's
//! space-filling curve, counted and gathered by world-fixed squares.

use timberline_pointcloud::frame::{TICKS_PER_M, ticks_from_world, world_from_ticks};
use timberline_pointcloud::order::{CURVE_CELL_M, morton};

/// A world-fixed square: edge 2^`log2_edge` metres, index `floor(world / edge)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell {
    /// Binary logarithm of the edge in metres; at least -3 (the curve's cell).
    pub log2_edge: i32,
    /// Row.
    pub iy: i64,
    /// Column.
    pub ix: i64,
}

impl Cell {
    /// Edge in metres.
    #[must_use]
    pub fn edge_m(&self) -> f64 {
        edge_m(self.log2_edge)
    }

    /// World position of the centre.
    #[must_use]
    pub fn centre(&self) -> [f64; 2] {
        [self.ix, self.iy].map(|i| (i as f64 + 0.5) * self.edge_m())
    }

    /// The four cells of half the edge.
    #[must_use]
    pub fn children(&self) -> [Self; 4] {
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(dy, dx)| Self {
            log2_edge: self.log2_edge - 1,
            iy: 2 * self.iy + dy,
            ix: 2 * self.ix + dx,
        })
    }

    /// The cell of a given edge that holds a world position.
    #[must_use]
    pub fn at(log2_edge: i32, world: [f64; 2]) -> Self {
        let index = |value: f64| (value / edge_m(log2_edge)).floor() as i64;
        Self { log2_edge, iy: index(world[1]), ix: index(world[0]) }
    }
}

/// 2^log2 metres, exact.
#[must_use]
pub fn edge_m(log2: i32) -> f64 {
    libm::ldexp(1.0, log2)
}

/// Merged ground points in the order of the world's space-filling curve.
///
/// Points whose (x, y) fall into one world-fixed square of `merge_m` become one node at the mean
/// position and elevation; with `merge_m = 0` only points with equal (x, y) are merged. All sums are
/// of integers (ticks of 0.1 mm), so nodes depend neither on the order of points nor on a frame.
#[derive(Debug, Clone, Default)]
pub struct Nodes {
    /// World positions in ticks, sorted by curve code, then x, y.
    ticks: Vec<[i64; 3]>,
    codes: Vec<u64>,
}

impl Nodes {
    /// Merges and sorts ground points given by world positions.
    #[must_use]
    pub fn new(world: impl Iterator<Item = [f64; 3]>, merge_m: f64) -> Self {
        let square = ((merge_m * TICKS_PER_M).round() as i64).max(1);
        let mut keyed: Vec<([i64; 2], [i64; 3])> = world
            .map(|position| {
                let ticks = position.map(ticks_from_world);
                ([ticks[0].div_euclid(square), ticks[1].div_euclid(square)], ticks)
            })
            .collect();
        keyed.sort_unstable();
        let mut coded: Vec<(u64, [i64; 3])> = keyed
            .chunk_by(|a, b| a.0 == b.0)
            .map(|group| {
                let mean = mean_of(group.iter().map(|(_, ticks)| *ticks));
                (morton(world_from_ticks(mean[0]), world_from_ticks(mean[1])), mean)
            })
            .collect();
        coded.sort_unstable();
        let (codes, ticks) = coded.into_iter().unzip();
        Self { ticks, codes }
    }

    /// Number of nodes.
    #[must_use]
    pub fn len(&self) -> usize {
        self.ticks.len()
    }

    /// Whether there are no nodes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ticks.is_empty()
    }

    /// World position of a node.
    #[must_use]
    pub fn world(&self, index: usize) -> [f64; 3] {
        self.ticks[index].map(world_from_ticks)
    }

    /// Position in ticks.
    #[must_use]
    pub fn ticks(&self, index: usize) -> [i64; 3] {
        self.ticks[index]
    }

    /// The nodes in a cell, which are one run.
    #[must_use]
    pub fn of_cell(&self, cell: Cell) -> std::ops::Range<usize> {
        let edge = cell.edge_m();
        let first = morton(cell.ix as f64 * edge, cell.iy as f64 * edge);
        let per_edge = (edge / CURVE_CELL_M) as u64;
        let last = first + per_edge * per_edge;
        let start = self.codes.partition_point(|code| *code < first);
        start..start + self.codes[start..].partition_point(|code| *code < last)
    }

    /// Calls `visit` with the nodes of the square that grows a cell by `margin_m` on all sides
    /// (half-open), in an order fixed in the world.
    pub fn around(&self, cell: Cell, margin_m: f64, mut visit: impl FnMut(usize)) {
        let ring = (margin_m / cell.edge_m()).ceil() as i64;
        let margin = ticks_from_world(margin_m);
        let edge = ticks_from_world(cell.edge_m());
        let low = [cell.ix * edge - margin, cell.iy * edge - margin];
        let width = edge + 2 * margin;
        for iy in cell.iy - ring..=cell.iy + ring {
            for ix in cell.ix - ring..=cell.ix + ring {
                for index in self.of_cell(Cell { iy, ix, ..cell }) {
                    let [x, y, _] = self.ticks[index];
                    if (0..width).contains(&(x - low[0])) && (0..width).contains(&(y - low[1])) {
                        visit(index);
                    }
                }
            }
        }
    }
}

/// Mean of positions, to the nearest tick.
fn mean_of(group: impl Iterator<Item = [i64; 3]>) -> [i64; 3] {
    let (mut sum, mut count) = ([0i64; 3], 0i64);
    for ticks in group {
        (0..3).for_each(|axis| sum[axis] += ticks[axis]);
        count += 1;
    }
    sum.map(|total| (2 * total + count).div_euclid(2 * count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn around_finds_what_lies_in_the_square(
            points in prop::collection::vec((-30f64..30., -30f64..30.), 0..80),
            cell in (-2i64..2, -2i64..2, 0i32..5), margin in 0u8..40,
        ) {
            let nodes = Nodes::new(points.iter().map(|p| [p.0, p.1, 0.0]), 0.0);
            let cell = Cell { log2_edge: cell.2, iy: cell.0, ix: cell.1 };
            let margin = f64::from(margin) * 0.25;
            let (low_x, low_y) = (cell.ix as f64 * cell.edge_m() - margin, cell.iy as f64 * cell.edge_m() - margin);
            let width = cell.edge_m() + 2.0 * margin;
            let expected = (0..nodes.len()).filter(|&i| {
                let [x, y, _] = nodes.world(i);
                x >= low_x && x < low_x + width && y >= low_y && y < low_y + width
            }).count();
            let mut found = Vec::new();
            nodes.around(cell, margin, |i| found.push(i));
            prop_assert_eq!(found.len(), expected);
            found.sort_unstable();
            found.dedup();
            prop_assert_eq!(found.len(), expected);
        }

        #[test]
        fn the_order_of_points_does_not_matter(points in prop::collection::vec((0i32..40, 0i32..40, 0i32..9), 1..60)) {
            let world = |p: &(i32, i32, i32)| [f64::from(p.0) * 0.05, f64::from(p.1) * 0.05, f64::from(p.2) * 0.1];
            let forward = Nodes::new(points.iter().map(world), 0.1);
            let backward = Nodes::new(points.iter().rev().map(world), 0.1);
            prop_assert_eq!(forward.ticks, backward.ticks);
        }
    }

    #[test]
    fn points_in_one_square_become_their_mean() {
        let nodes =
            Nodes::new([[0.01, 0.02, 1.0], [0.03, 0.04, 2.0], [0.3, 0.3, 5.0]].into_iter(), 0.1);
        assert_eq!(nodes.len(), 2);
        assert_eq!(nodes.world(0), [0.02, 0.03, 1.5]);
    }
}
