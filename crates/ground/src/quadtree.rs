//! Which world-fixed squares carry a patch: small where ground points are dense, large where they
//! are sparse.
//!
//! A square is divided when its neighbourhood holds more than a given number of nodes. The
//! neighbourhood of a child lies inside its parent's, so the decision depends on nothing but the
//! nodes near the square, and every tile that sees those nodes draws the same leaves.

use crate::nodes::{Cell, Nodes};
use timberline_pointcloud::Rect;

/// How far a patch's nodes reach beyond its square, in units of the edge.
pub const SUPPORT_MARGIN: f64 = 0.5;
/// How far a patch's weight reaches beyond its square, in units of the edge. Below
/// [`SUPPORT_MARGIN`], so that every node where a patch counts is one of its own.
pub const BLEND_MARGIN: f64 = 0.25;

/// The rule of division.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Division {
    /// log2 of the edge of the largest squares, metres.
    pub log2_root: i32,
    /// log2 of the edge of the smallest squares, metres.
    pub log2_smallest: i32,
    /// A square whose neighbourhood holds more nodes is divided.
    pub most_nodes: usize,
}

impl Division {
    /// The leaves whose weight reaches into a world rectangle, sorted by root square, then in order
    /// of division.
    #[must_use]
    pub fn leaves_over(&self, nodes: &Nodes, rect: Rect) -> Vec<Cell> {
        let reach = BLEND_MARGIN * crate::nodes::edge_m(self.log2_root);
        let grown = rect.grown(reach);
        let low = Cell::at(self.log2_root, grown.min);
        let high = Cell::at(self.log2_root, grown.max);
        let mut leaves = Vec::new();
        for iy in low.iy..=high.iy {
            for ix in low.ix..=high.ix {
                let root = Cell { log2_edge: self.log2_root, iy, ix };
                self.descend(nodes, root, &mut leaves);
            }
        }
        leaves.retain(|leaf| blend_rect(*leaf).touches(&rect));
        leaves
    }

    /// All leaves of one root square.
    #[must_use]
    pub fn leaves_of(&self, nodes: &Nodes, root: Cell) -> Vec<Cell> {
        let mut leaves = Vec::new();
        self.descend(nodes, root, &mut leaves);
        leaves
    }

    fn descend(&self, nodes: &Nodes, cell: Cell, leaves: &mut Vec<Cell>) {
        let mut count = 0usize;
        if cell.log2_edge > self.log2_smallest {
            nodes.around(cell, SUPPORT_MARGIN * cell.edge_m(), |_| count += 1);
        }
        if count > self.most_nodes {
            cell.children().into_iter().for_each(|child| self.descend(nodes, child, leaves));
        } else {
            leaves.push(cell);
        }
    }
}

/// Where a leaf's patch has weight.
#[must_use]
pub fn blend_rect(cell: Cell) -> Rect {
    let half = (0.5 + BLEND_MARGIN) * cell.edge_m();
    let centre = cell.centre();
    Rect { min: centre.map(|c| c - half), max: centre.map(|c| c + half) }
}

/// Weight of a leaf's patch at an offset from its centre: 1 in the middle half, falling to 0 at the
/// border of [`blend_rect`] with two continuous derivatives (the quintic step of Perlin 2002).
#[must_use]
pub fn weight(edge_m: f64, dx: f64, dy: f64) -> f64 {
    side_weight(edge_m, dx) * side_weight(edge_m, dy)
}

fn side_weight(edge_m: f64, offset: f64) -> f64 {
    let inner = (0.5 - BLEND_MARGIN) * edge_m;
    let t = ((offset.abs() - inner) / (2.0 * BLEND_MARGIN * edge_m)).clamp(0.0, 1.0);
    1.0 - t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DIVISION: Division = Division { log2_root: 4, log2_smallest: 0, most_nodes: 40 };

    fn clustered(seed: &[f64]) -> Nodes {
        let points = seed.chunks_exact(2).enumerate().map(|(i, p)| {
            let shrink = if i % 3 == 0 { 0.1 } else { 1.0 };
            [p[0] * 60.0 * shrink, p[1] * 60.0 * shrink, 0.0]
        });
        Nodes::new(points, 0.0)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn leaves_cover_the_plane_once(seed in prop::collection::vec(0f64..1., 800), at in (0f64..60., 0f64..60.)) {
            let nodes = clustered(&seed);
            let leaves = DIVISION.leaves_over(&nodes, Rect { min: [0.0; 2], max: [60.0; 2] });
            let holding = leaves.iter().filter(|leaf| Cell::at(leaf.log2_edge, [at.0, at.1]) == **leaf).count();
            prop_assert_eq!(holding, 1);
        }

        #[test]
        fn a_part_draws_the_same_leaves(seed in prop::collection::vec(0f64..1., 800), corner in (0f64..40., 0f64..40.)) {
            let nodes = clustered(&seed);
            let part = Rect { min: [corner.0, corner.1], max: [corner.0 + 7.0, corner.1 + 5.0] };
            let all = DIVISION.leaves_over(&nodes, Rect { min: [0.0; 2], max: [60.0; 2] });
            let expected: Vec<Cell> = all.into_iter().filter(|leaf| blend_rect(*leaf).touches(&part)).collect();
            prop_assert_eq!(DIVISION.leaves_over(&nodes, part), expected);
        }

        #[test]
        fn weights_of_equal_squares_sum_to_one(x in -8f64..8., y in -8f64..8.) {
            let near = (-2i64..=2).flat_map(|iy| (-2i64..=2).map(move |ix| Cell { log2_edge: 3, iy, ix }));
            let sum: f64 = near.map(|cell| {
                let [cx, cy] = cell.centre();
                weight(cell.edge_m(), x - cx, y - cy)
            }).sum();
            prop_assert!((sum - 1.0).abs() < 1e-12);
        }
    }
}
