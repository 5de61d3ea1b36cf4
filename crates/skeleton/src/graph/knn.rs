//! The graph of nearest neighbours.

use super::{Graph, add_up};
use crate::kdtree::{KdTree, Near};
use crate::vector::Vector;
use rayon::prelude::*;

/// Points that one task looks up.
const CHUNK: usize = 4096;

/// The nearest neighbours of every point, nearest first, equal distances by index.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbours {
    /// Neighbours of each point: the number asked for, or all others where there are fewer points.
    pub each: usize,
    /// Indices, `each` per point.
    pub index: Vec<u32>,
    /// Distance to the neighbour of rank `rank` (from 1), m, of every point.
    pub spacing_m: Vec<f64>,
}

impl Neighbours {
    /// Finds `count` neighbours of every point; the distance to that of `rank` is kept. Points are
    /// different from each other and best sorted along a curve.
    #[must_use]
    pub fn new(points: &[[f64; 3]], count: usize, rank: usize) -> Self {
        Self::by(&KdTree::new(points), points, count, rank)
    }

    pub(crate) fn by(tree: &KdTree, points: &[Vector], count: usize, rank: usize) -> Self {
        let each = count.min(points.len() - 1);
        let rank = rank.clamp(1, each.max(1)) - 1;
        let chunks: Vec<(Vec<u32>, Vec<f64>)> = points
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(chunk, part)| {
                let mut found: Vec<Near> = Vec::with_capacity(each + 1);
                let mut index = Vec::with_capacity(part.len() * each);
                let mut spacing = Vec::with_capacity(part.len());
                for (i, p) in part.iter().enumerate() {
                    tree.nearest(p, (chunk * CHUNK + i) as u32, each, &mut found);
                    index.extend(found.iter().map(|near| near.1));
                    spacing.push(found.get(rank).map_or(0.0, |near| near.0.sqrt()));
                }
                (index, spacing)
            })
            .collect();
        let mut all = Self { each, index: Vec::new(), spacing_m: Vec::new() };
        for (index, spacing) in chunks {
            all.index.extend(index);
            all.spacing_m.extend(spacing);
        }
        all
    }

    /// The neighbours of a point.
    #[must_use]
    pub fn of(&self, point: u32) -> &[u32] {
        &self.index[point as usize * self.each..(point as usize + 1) * self.each]
    }

    /// The graph with an edge where one point is among the neighbours of the other.
    #[must_use]
    pub fn graph(&self) -> Graph {
        let len = self.spacing_m.len();
        let one_way = |a: u32, b: u32| !self.of(b).contains(&a);
        let mut start = vec![0u32; len + 1];
        for a in 0..len as u32 {
            start[a as usize + 1] += self.each as u32;
            self.of(a).iter().filter(|&&b| one_way(a, b)).for_each(|&b| start[b as usize + 1] += 1);
        }
        add_up(&mut start);
        let mut to = vec![0; start[len] as usize];
        let mut next = start.clone();
        let mut put = |a: u32, b: u32| {
            to[next[a as usize] as usize] = b;
            next[a as usize] += 1;
        };
        for a in 0..len as u32 {
            for &b in self.of(a) {
                put(a, b);
                if one_way(a, b) {
                    put(b, a);
                }
            }
        }
        Graph { start, to }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_of_points() {
        let points: Vec<Vector> = (0..5).map(|i| [f64::from(i * i), 0.0, 0.0]).collect();
        let near = Neighbours::new(&points, 1, 1);
        assert_eq!(near.index, [1, 0, 1, 2, 3]);
        assert_eq!(near.spacing_m, [1.0, 1.0, 3.0, 5.0, 7.0]);
        let edges: Vec<[u32; 2]> = near.graph().edges().collect();
        assert_eq!(edges, [[0, 1], [1, 2], [2, 3], [3, 4]]);
        assert_eq!(Neighbours::new(&points, 30, 30).each, 4);
    }
}
