//! Voxels and their neighbours.

use crate::Error;
use crate::joined::Joined;
use rayon::prelude::*;
use timberline_pointcloud::Nearest3;

/// Neighbours a voxel is linked to.
const NEIGHBOURS: usize = 10;
/// No neighbour.
const NONE: u32 = u32::MAX;
/// Edge of the cells between which gaps are bridged, in parts of the widest gap.
const CELLS_IN_GAP: f64 = 2.0;

/// Links between positions, in both directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Graph<'a> {
    positions: &'a [[f64; 3]],
    start: Vec<u64>,
    to: Vec<u32>,
}

impl<'a> Graph<'a> {
    /// Links every position to its nearest ones, none longer than `gap_m`, and parts that are not
    /// linked by the shortest bridges between cells of the plot.
    ///
    /// # Errors
    /// [`Error::Neighbours`].
    pub fn new(positions: &'a [[f64; 3]], gap_m: f64) -> Result<Self, Error> {
        let index = Nearest3::new(positions)?;
        let near = |(from, at): (usize, &[f64; 3])| {
            // A plot has tens of millions of voxels: rows of a fixed length take the least memory.
            let mut row = [NONE; NEIGHBOURS];
            let found = index.nearest(at, NEIGHBOURS + 1).into_iter();
            let close = found.filter(|to| to.index != from && to.squared_m2 <= gap_m * gap_m);
            row.iter_mut().zip(close).for_each(|(place, to)| *place = to.index as u32);
            row
        };
        let rows: Vec<[u32; NEIGHBOURS]> = positions.par_iter().enumerate().map(near).collect();
        drop(index);
        let links = || {
            let of = |(from, row): (u32, &'_ [u32; NEIGHBOURS])| {
                row.map(|to| (from, to)).into_iter().filter(|(_, to)| *to != NONE)
            };
            (0u32..).zip(&rows).flat_map(of)
        };
        let bridges = bridges(positions, links(), gap_m);
        Ok(Self::from_links(positions, || links().chain(bridges.iter().copied())))
    }

    /// Counts the links of every position, puts them in their places, and sorts and thins each row.
    fn from_links<I: Iterator<Item = (u32, u32)>>(
        positions: &'a [[f64; 3]],
        links: impl Fn() -> I,
    ) -> Self {
        let mut end = vec![0u64; positions.len() + 1];
        for (from, to) in links() {
            end[from as usize + 1] += 1;
            end[to as usize + 1] += 1;
        }
        (1..end.len()).for_each(|at| end[at] += end[at - 1]);
        let mut to = vec![NONE; end[positions.len()] as usize];
        let mut next = end.clone();
        for (a, b) in links() {
            for (from, other) in [(a, b), (b, a)] {
                to[next[from as usize] as usize] = other;
                next[from as usize] += 1;
            }
        }
        let mut start = vec![0u64; positions.len() + 1];
        let mut kept = 0;
        for from in 0..positions.len() {
            let row = end[from] as usize..end[from + 1] as usize;
            to[row.clone()].sort_unstable();
            start[from] = kept as u64;
            for place in row {
                if kept as u64 == start[from] || to[kept - 1] != to[place] {
                    to[kept] = to[place];
                    kept += 1;
                }
            }
        }
        start[positions.len()] = kept as u64;
        to.truncate(kept);
        Self { positions, start, to }
    }

    /// Number of positions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are no positions.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Neighbours of a position with their distances in metres, by ascending index.
    pub fn neighbours(&self, from: u32) -> impl Iterator<Item = (u32, f64)> {
        let range = self.start[from as usize] as usize..self.start[from as usize + 1] as usize;
        let here = self.positions[from as usize];
        self.to[range].iter().map(move |&to| (to, distance_m(here, self.positions[to as usize])))
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
fn bridges(
    positions: &[[f64; 3]],
    links: impl Iterator<Item = (u32, u32)>,
    gap_m: f64,
) -> Vec<(u32, u32)> {
    let mut joined = Joined::new(positions.len());
    links.for_each(|(from, to)| joined.join(from, to));
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
    found: &mut Vec<(u32, u32)>,
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
    found.extend(best.into_values().map(|(_, a, b)| (a, b)));
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
        let positions = row(0.0, 30);
        let graph = Graph::new(&positions, 1.0).unwrap();
        for from in 0..30 {
            for (to, length) in graph.neighbours(from) {
                assert!(graph.neighbours(to).any(|back| back == (from, length)));
            }
        }
    }
}
