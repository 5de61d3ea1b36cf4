//! Voxels and their neighbours.

use crate::Error;
use crate::joined::Joined;
use rayon::prelude::*;
use timberline_pointcloud::Nearest3;

/// Neighbours a voxel is linked to.
const NEIGHBOURS: usize = 10;
/// Edge of the cells between which gaps are bridged, in parts of the widest gap.
const CELLS_IN_GAP: f64 = 2.0;

/// Links between positions, in both directions.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    start: Vec<u32>,
    to: Vec<u32>,
    length_m: Vec<f64>,
}

impl Graph {
    /// Links every position to its nearest ones, none longer than `gap_m`, and parts that are not
    /// linked by the shortest bridges between cells of the plot.
    ///
    /// # Errors
    /// [`Error::Neighbours`].
    pub fn new(positions: &[[f64; 3]], gap_m: f64) -> Result<Self, Error> {
        let index = Nearest3::new(positions)?;
        let near = |(from, at): (usize, &[f64; 3])| {
            let found = index.nearest(at, NEIGHBOURS + 1).into_iter();
            let linked = found.filter(|to| to.index != from);
            let close = linked.filter(|to| to.squared_m2 <= gap_m * gap_m);
            close.map(|to| (from as u32, to.index as u32, to.squared_m2.sqrt())).collect::<Vec<_>>()
        };
        let mut links: Vec<(u32, u32, f64)> =
            positions.par_iter().enumerate().flat_map_iter(near).collect();
        let bridges = bridges(positions, &links, gap_m);
        links.extend(bridges);
        Ok(Self::from_links(positions.len(), links))
    }

    fn from_links(len: usize, links: Vec<(u32, u32, f64)>) -> Self {
        let back: Vec<_> = links.iter().map(|&(from, to, length)| (to, from, length)).collect();
        let mut all = links;
        all.extend(back);
        all.sort_by_key(|link| (link.0, link.1));
        all.dedup_by_key(|link| (link.0, link.1));
        let mut graph = Self { start: Vec::with_capacity(len + 1), ..Self::default() };
        let mut next = 0;
        for from in 0..len as u32 {
            graph.start.push(next as u32);
            next += all[next..].iter().take_while(|link| link.0 == from).count();
        }
        graph.start.push(next as u32);
        graph.to = all.iter().map(|link| link.1).collect();
        graph.length_m = all.iter().map(|link| link.2).collect();
        graph
    }

    /// Number of positions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// Whether there are no positions.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Neighbours of a position with their distances in metres, by ascending index.
    pub fn neighbours(&self, from: u32) -> impl Iterator<Item = (u32, f64)> {
        let range = self.start[from as usize] as usize..self.start[from as usize + 1] as usize;
        self.to[range.clone()].iter().copied().zip(self.length_m[range].iter().copied())
    }

    /// The part of the graph every position belongs to: the smallest index in it.
    #[must_use]
    pub fn parts(&self) -> Vec<u32> {
        let mut joined = Joined::new(self.len());
        for from in 0..self.len() as u32 {
            self.neighbours(from).for_each(|(to, _)| joined.join(from, to));
        }
        (0..self.len() as u32).map(|at| joined.root(at)).collect()
    }
}

/// The shortest bridge between every two parts in cells that are near each other, no longer than
/// `gap_m`.
fn bridges(positions: &[[f64; 3]], links: &[(u32, u32, f64)], gap_m: f64) -> Vec<(u32, u32, f64)> {
    let mut joined = Joined::new(positions.len());
    links.iter().for_each(|(from, to, _)| joined.join(*from, *to));
    let part: Vec<u32> = (0..positions.len() as u32).map(|at| joined.root(at)).collect();
    let cell_m = gap_m / CELLS_IN_GAP;
    let cell = |at: u32| positions[at as usize].map(|value| (value / cell_m).floor() as i32);
    let mut order: Vec<([i32; 3], u32)> =
        (0..positions.len() as u32).map(|at| (cell(at), at)).collect();
    order.sort_unstable();
    let cells: Vec<&[([i32; 3], u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    let bridge = |here: &&[([i32; 3], u32)]| {
        let mut found = Vec::new();
        for there in around(&cells, here[0].0) {
            shortest(positions, &part, here, there, gap_m, &mut found);
        }
        found
    };
    cells.par_iter().flat_map_iter(bridge).collect()
}

/// The cells within the widest gap of a cell that come after it, itself included.
fn around<'a>(
    cells: &'a [&'a [([i32; 3], u32)]],
    here: [i32; 3],
) -> impl Iterator<Item = &'a [([i32; 3], u32)]> {
    let reach = CELLS_IN_GAP as i32;
    let columns = (0..=reach).flat_map(move |dx| (-reach..=reach).map(move |dy| (dx, dy)));
    columns.flat_map(move |(dx, dy)| {
        let low = [here[0] + dx, here[1] + dy, here[2] - reach];
        let high = [here[0] + dx, here[1] + dy, here[2] + reach];
        let first = cells.partition_point(|cell| cell[0].0 < low);
        let found = cells[first..].iter().take_while(move |cell| cell[0].0 <= high);
        found.filter(move |cell| cell[0].0 >= here).copied()
    })
}

/// Adds the shortest bridge between each two different parts in two cells.
fn shortest(
    positions: &[[f64; 3]],
    part: &[u32],
    here: &[([i32; 3], u32)],
    there: &[([i32; 3], u32)],
    gap_m: f64,
    found: &mut Vec<(u32, u32, f64)>,
) {
    let parts = |cell: &[([i32; 3], u32)]| {
        let mut parts: Vec<u32> = cell.iter().map(|(_, at)| part[*at as usize]).collect();
        parts.sort_unstable();
        parts.dedup();
        parts
    };
    let (mine, theirs) = (parts(here), parts(there));
    if mine.len() == 1 && mine == theirs {
        return;
    }
    let mut best: std::collections::BTreeMap<(u32, u32), (f64, u32, u32)> = Default::default();
    for (_, a) in here {
        for (_, b) in there {
            let (p, q) = (part[*a as usize], part[*b as usize]);
            if p == q {
                continue;
            }
            let length_m = distance_m(positions[*a as usize], positions[*b as usize]);
            if length_m > gap_m {
                continue;
            }
            let bridge = (length_m, *a.min(b), *a.max(b));
            let known = best.entry((p.min(q), p.max(q))).or_insert(bridge);
            if bridge < *known {
                *known = bridge;
            }
        }
    }
    found.extend(best.into_values().map(|(length, a, b)| (a, b, length)));
}

fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(from: f64, count: u32) -> Vec<[f64; 3]> {
        (0..count).map(|k| [from + 0.05 * f64::from(k), 0.0, 0.0]).collect()
    }

    #[test]
    fn a_gap_is_bridged_once_and_a_wide_one_is_not() {
        let mut positions = row(0.0, 40);
        positions.extend(row(2.55, 40));
        positions.extend(row(9.0, 40));
        let graph = Graph::new(&positions, 1.0).unwrap();
        let parts = graph.parts();
        assert!(parts[..80].iter().all(|part| *part == 0));
        assert!(parts[80..].iter().all(|part| *part == 80));
        let long = |(_, length): &(u32, f64)| *length > 0.59;
        let bridges: Vec<_> = (0..40).flat_map(|at| graph.neighbours(at)).filter(long).collect();
        assert_eq!(bridges.len(), 1, "{bridges:?}");
    }

    #[test]
    fn links_go_both_ways() {
        let graph = Graph::new(&row(0.0, 30), 1.0).unwrap();
        for from in 0..30 {
            for (to, length) in graph.neighbours(from) {
                assert!(graph.neighbours(to).any(|back| back == (from, length)));
            }
        }
    }
}
