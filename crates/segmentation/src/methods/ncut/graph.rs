//! A graph with weighted edges.

/// A symmetric graph by rows; vertices may have an edge to themselves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    starts: Vec<usize>,
    ends: Vec<u32>,
    weights: Vec<f32>,
}

impl Graph {
    /// A graph of the given edges from every vertex, ascending by the other end. Whoever calls sees
    /// to it that each edge is there from both ends, with the same positive weight.
    #[must_use]
    pub fn from_rows(rows: impl Iterator<Item = Vec<(u32, f32)>>) -> Self {
        let mut graph = Self { starts: vec![0], ..Self::default() };
        for row in rows {
            for (end, weight) in row {
                graph.ends.push(end);
                graph.weights.push(weight);
            }
            graph.starts.push(graph.ends.len());
        }
        graph
    }

    /// Number of vertices.
    #[must_use]
    pub fn len(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Whether there are no vertices.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The edges of a vertex: other end and weight.
    pub fn edges(&self, vertex: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let places = self.starts[vertex]..self.starts[vertex + 1];
        let ends = self.ends[places.clone()].iter().map(|end| *end as usize);
        ends.zip(self.weights[places].iter().map(|weight| f64::from(*weight)))
    }

    /// Sum of the weights of every vertex's edges.
    #[must_use]
    pub fn degrees(&self) -> Vec<f64> {
        (0..self.len()).map(|v| self.edges(v).map(|(_, weight)| weight).sum()).collect()
    }

    /// The graph of some of the vertices (ascending), which are renumbered in their sequence.
    #[must_use]
    pub fn part(&self, members: &[u32]) -> Self {
        let mut place = vec![u32::MAX; self.len()];
        members.iter().zip(0..).for_each(|(&member, new)| place[member as usize] = new);
        let row = |&member: &u32| {
            let inside = |(end, weight): (usize, f64)| {
                (place[end] != u32::MAX).then_some((place[end], weight as f32))
            };
            self.edges(member as usize).filter_map(inside).collect()
        };
        Self::from_rows(members.iter().map(row))
    }

    /// The connected parts, each ascending, by their first vertex.
    #[must_use]
    pub fn components(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.len()];
        let mut components = Vec::new();
        for first in 0..self.len() {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            let mut component = vec![first as u32];
            let mut next = 0;
            while next < component.len() {
                for (end, _) in self.edges(component[next] as usize) {
                    if !std::mem::replace(&mut seen[end], true) {
                        component.push(end as u32);
                    }
                }
                next += 1;
            }
            component.sort_unstable();
            components.push(component);
        }
        components
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_and_components() {
        let pairs = [(0, 2, 1.0), (2, 4, 0.5), (1, 3, 2.0)];
        let row = |v: u32| {
            let other = |&(a, b, w): &(u32, u32, f32)| {
                (a == v).then_some((b, w)).or((b == v).then_some((a, w)))
            };
            pairs.iter().filter_map(other).collect()
        };
        let graph = Graph::from_rows((0..5).map(row));
        assert_eq!(graph.components(), [vec![0, 2, 4], vec![1, 3]]);
        assert_eq!(graph.degrees(), [1.0, 2.0, 1.5, 2.0, 0.5]);
        let part = graph.part(&[2, 3, 4]);
        assert_eq!(part.edges(0).collect::<Vec<_>>(), [(2, 0.5)]);
        assert_eq!(part.degrees(), [0.5, 0.0, 0.5]);
    }
}
