//! Step 3: the tree of edges that spans the points.

use crate::graph::Graph;
use crate::graph::delaunay::delaunay;
use crate::graph::emst::bridges;
use crate::graph::knn::Neighbours;
use crate::kdtree::KdTree;
use crate::levels::median;
use crate::model::GraphKind;
use crate::paths::shortest;
use crate::vector::{Vector, squared};
use crate::{Edges, SkeletonParams, Tree};

/// Neighbours in the graph for clouds too large for Delaunay: at 100,000 points 0.2 % of the vertices
/// then have a longer path than over the triangulation, the worst by 17 %.
const NEIGHBOURS: usize = 32;

/// Rank of the neighbour whose distance is the spacing at a point.
const SPACING_RANK: usize = 4;

/// A tree over all points.
#[derive(Debug)]
pub(super) struct Spanned {
    /// The point before each on its way from the root.
    pub(super) parent: Vec<u32>,
    /// All points, each after its parent.
    pub(super) order: Vec<u32>,
    pub(super) graph: GraphKind,
    pub(super) spacing_m: f64,
}

/// Spans the points by edges found between them as they are and weighted as they are centred.
pub(super) fn span(
    points: &[Vector],
    centred: &[Vector],
    root: u32,
    params: &SkeletonParams,
) -> Spanned {
    let tree = KdTree::new(points);
    let near = Neighbours::by(&tree, points, NEIGHBOURS, SPACING_RANK);
    let triangulate = match params.edges {
        Edges::Auto => points.len() <= params.most_delaunay as usize,
        Edges::Delaunay => true,
        Edges::Neighbours => false,
    };
    let found = if triangulate { delaunay(points) } else { None };
    let kind = if found.is_some() { GraphKind::Delaunay } else { GraphKind::Neighbours };
    let graph = found.unwrap_or_else(|| {
        let graph = near.graph();
        let links = bridges(&tree, points, &graph.sets());
        graph.with(&links.iter().map(|link| link.ends).collect::<Vec<_>>())
    });
    // Centred points may coincide: an edge still costs something, so that every way has an end.
    let weight = |a: u32, b: u32| squared(centred[a as usize], centred[b as usize]).max(1e-12);
    let graph = match params.tree {
        Tree::ShortestPaths => graph,
        Tree::SpanningTree => spanning_tree(&graph, weight),
    };
    let paths = shortest(&graph, &[(root, 0.0)], weight);
    let spacing_m = median(&near.spacing_m);
    Spanned { parent: paths.parent, order: paths.order, graph: kind, spacing_m }
}

/// The minimum spanning tree of a graph (Kruskal 1956); of equal edges the one of smaller vertices.
fn spanning_tree(graph: &Graph, weight: impl Fn(u32, u32) -> f64) -> Graph {
    let mut edges: Vec<(f64, [u32; 2])> =
        graph.edges().map(|edge| (weight(edge[0], edge[1]), edge)).collect();
    edges.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut set: Vec<u32> = (0..graph.len() as u32).collect();
    let mut kept = Vec::new();
    for (_, edge) in edges {
        let [a, b] = edge.map(|end| root_of(&mut set, end));
        if a != b {
            set[a.max(b) as usize] = a.min(b);
            kept.push(edge);
        }
    }
    Graph::new(graph.len(), &kept)
}

fn root_of(set: &mut [u32], of: u32) -> u32 {
    let mut at = of;
    while set[at as usize] != at {
        set[at as usize] = set[set[at as usize] as usize];
        at = set[at as usize];
    }
    at
}

impl Spanned {
    /// Whether every point but the root has a parent.
    #[cfg(test)]
    fn is_whole(&self) -> bool {
        self.order.len() == self.parent.len()
            && self.parent.iter().filter(|&&parent| parent == crate::paths::NONE).count() == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::graph::emst::emst;

    fn cloud() -> Vec<Vector> {
        (0..900u32)
            .map(|i| {
                let of = |k: u32| f64::from((i * k + i * i * 7) % 1009) / 1009.0;
                [of(131), of(577), 3.0 * of(919)]
            })
            .collect()
    }

    #[test]
    fn the_spanning_tree_over_delaunay_is_the_euclidean_one() {
        let points = cloud();
        let graph = delaunay(&points).unwrap();
        let length = |a: u32, b: u32| squared(points[a as usize], points[b as usize]);
        let tree = spanning_tree(&graph, length);
        let over: f64 = tree.edges().map(|e| length(e[0], e[1]).sqrt()).sum();
        let exact: f64 = emst(&points).iter().map(|link| link.squared_m2.sqrt()).sum();
        assert!((over - exact).abs() < 1e-9, "{over} {exact}");
    }

    #[test]
    fn paths_over_delaunay_are_those_over_all_pairs() {
        let points: Vec<Vector> = cloud().into_iter().take(250).collect();
        let length = |a: u32, b: u32| squared(points[a as usize], points[b as usize]);
        let all: Vec<[u32; 2]> =
            (0..250).flat_map(|a| (a + 1..250).map(move |b| [a, b])).collect();
        let exact = shortest(&Graph::new(250, &all), &[(0, 0.0)], length).cost;
        let over = shortest(&delaunay(&points).unwrap(), &[(0, 0.0)], length).cost;
        for (a, b) in exact.iter().zip(&over) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn flat_points_fall_back_to_neighbours() {
        let flat: Vec<Vector> = cloud().into_iter().map(|p| [p[0], p[1], 0.0]).collect();
        let spanned = span(&flat, &flat, 0, &SkeletonParams::default());
        assert_eq!(spanned.graph, GraphKind::Neighbours);
        assert!(spanned.is_whole());
    }
}
