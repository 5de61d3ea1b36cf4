//! Neighbour graphs over points: Delaunay, nearest neighbours, the spanning tree.

pub mod delaunay;
pub mod emst;
pub mod knn;

/// An undirected graph: the neighbours of every vertex, one after the other.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Graph {
    start: Vec<u32>,
    to: Vec<u32>,
}

impl Graph {
    /// The graph with these edges; each may be given once or both ways round.
    #[must_use]
    pub fn new(vertices: usize, edges: &[[u32; 2]]) -> Self {
        let mut both: Vec<[u32; 2]> = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        both.sort_unstable();
        both.dedup();
        let mut start = vec![0; vertices + 1];
        both.iter().for_each(|edge| start[edge[0] as usize + 1] += 1);
        add_up(&mut start);
        Self { start, to: both.into_iter().map(|edge| edge[1]).collect() }
    }

    /// The neighbours of a vertex.
    #[must_use]
    pub fn of(&self, vertex: u32) -> &[u32] {
        let place = vertex as usize;
        &self.to[self.start[place] as usize..self.start[place + 1] as usize]
    }

    /// Number of vertices.
    #[must_use]
    pub fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Whether there is no vertex.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Every edge once, from the smaller vertex to the larger, sorted.
    pub fn edges(&self) -> impl Iterator<Item = [u32; 2]> {
        (0..self.len() as u32).flat_map(move |a| {
            self.of(a).iter().filter(move |&&b| b > a).map(move |&b| [a, b])
        })
    }

    /// The graph with more edges.
    #[must_use]
    pub fn with(&self, more: &[[u32; 2]]) -> Self {
        if more.is_empty() {
            return self.clone();
        }
        let mut edges: Vec<[u32; 2]> = self.edges().collect();
        edges.extend_from_slice(more);
        Self::new(self.len(), &edges)
    }

    /// The connected set of every vertex: sets are numbered in the order of their first vertices.
    #[must_use]
    pub fn sets(&self) -> Vec<u32> {
        let mut set = vec![u32::MAX; self.len()];
        let (mut next, mut open) = (0, Vec::new());
        for first in 0..self.len() as u32 {
            if set[first as usize] != u32::MAX {
                continue;
            }
            set[first as usize] = next;
            open.push(first);
            while let Some(at) = open.pop() {
                for &to in self.of(at) {
                    if set[to as usize] == u32::MAX {
                        set[to as usize] = next;
                        open.push(to);
                    }
                }
            }
            next += 1;
        }
        set
    }
}

/// Running sums in place.
fn add_up(counts: &mut [u32]) {
    let mut sum = 0;
    for count in counts {
        sum += *count;
        *count = sum;
    }
}
