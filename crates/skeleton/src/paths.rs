//! Shortest paths from the base over a graph, the same however the points came.

use crate::graph::Graph;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// No parent.
pub const NONE: u32 = u32::MAX;

/// The tree of shortest paths.
#[derive(Debug, Clone, PartialEq)]
pub struct Paths {
    /// Cost of the path to every vertex; infinite where there is none.
    pub cost: Vec<f64>,
    /// The vertex before each on its path; [`NONE`] for sources and vertices out of reach.
    pub parent: Vec<u32>,
    /// Vertices that can be reached, in the order of cost: every one after its parent.
    pub order: Vec<u32>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Open {
    cost: f64,
    vertex: u32,
}

impl Eq for Open {}

impl Ord for Open {
    /// Cheapest first, then the smaller vertex.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.vertex.cmp(&self.vertex))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Shortest paths (Dijkstra 1959) from sources with a cost of their own, with `weight` as the cost of
/// an edge (above 0). Of two paths of equal cost the one over the smaller vertex is taken: with
/// vertices in canonical order the result does not depend on the order of edges.
#[must_use]
pub fn shortest(graph: &Graph, sources: &[(u32, f64)], weight: impl Fn(u32, u32) -> f64) -> Paths {
    let len = graph.len();
    let mut paths =
        Paths { cost: vec![f64::INFINITY; len], parent: vec![NONE; len], order: Vec::new() };
    let mut open = BinaryHeap::with_capacity(len);
    for &(vertex, cost) in sources {
        if cost < paths.cost[vertex as usize] {
            paths.cost[vertex as usize] = cost;
            open.push(Open { cost, vertex });
        }
    }
    let mut done = vec![false; len];
    while let Some(Open { cost, vertex }) = open.pop() {
        if std::mem::replace(&mut done[vertex as usize], true) {
            continue;
        }
        paths.order.push(vertex);
        for &to in graph.of(vertex).iter().filter(|&&to| !done[to as usize]) {
            let (new, known) = (cost + weight(vertex, to), paths.cost[to as usize]);
            if new < known {
                paths.cost[to as usize] = new;
                paths.parent[to as usize] = vertex;
                open.push(Open { cost: new, vertex: to });
            } else if new == known && replaces(vertex, paths.parent[to as usize]) {
                paths.parent[to as usize] = vertex;
            }
        }
    }
    paths
}

/// Whether a parent that makes a path no longer takes the place of another. Sources have none.
fn replaces(new: u32, old: u32) -> bool {
    old != NONE && new < old
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_tie_goes_over_the_smaller_vertex() {
        let graph = Graph::new(4, &[[3, 2], [3, 1], [0, 2], [0, 1]]);
        let paths = shortest(&graph, &[(0, 0.0)], |_, _| 1.0);
        assert_eq!(paths.parent, [NONE, 0, 0, 1]);
        assert_eq!(paths.order, [0, 1, 2, 3]);
    }

    proptest! {
        #[test]
        fn as_repeated_relaxation(
            edges in prop::collection::vec((0u32..20, 0u32..20), 1..80), source in 0u32..20,
        ) {
            let edges: Vec<[u32; 2]> =
                edges.iter().filter(|e| e.0 != e.1).map(|e| [e.0, e.1]).collect();
            let weight = |a: u32, b: u32| f64::from((a * b) % 7 + 1);
            let paths = shortest(&Graph::new(20, &edges), &[(source, 0.0)], weight);
            let mut cost = [f64::INFINITY; 20];
            cost[source as usize] = 0.0;
            for _ in 0..20 {
                for &[a, b] in &edges {
                    let w = weight(a, b);
                    let (x, y) = (cost[a as usize], cost[b as usize]);
                    cost[a as usize] = x.min(y + w);
                    cost[b as usize] = y.min(x + w);
                }
            }
            prop_assert_eq!(&paths.cost[..], &cost[..]);
            for (v, &parent) in paths.parent.iter().enumerate().filter(|(_, p)| **p != NONE) {
                prop_assert_eq!(cost[parent as usize] + weight(parent, v as u32), cost[v]);
            }
        }
    }
}
