//! Points sorted by the cells of a lattice, and walks along the sorted cells.

use super::kernel::{Block, LANES};
use std::ops::Range;

/// Cells on either side of a point's that its support can touch: a cell is half of the reach.
const RINGS: i64 = 2;
/// Edge of a cell over the reach.
pub(super) const CELL_SHARE: f64 = 0.5;
/// Rows of cells around a cell.
const ROWS: usize = (2 * RINGS as usize + 1) * (2 * RINGS as usize + 1);

/// Points in the sequence of their cells, ready to be summed over.
#[derive(Debug, Default)]
pub(super) struct Cells {
    cell_m: f64,
    /// Occupied cells, sorted.
    keys: Vec<u128>,
    /// `starts[i]..starts[i + 1]` are the places of cell `i`.
    starts: Vec<u32>,
    /// The index of the point at each place.
    pub(super) order: Vec<u32>,
    at: Vec<[f64; 3]>,
    narrowness: Vec<f32>,
    weight: Vec<f32>,
}

/// The three indices of a cell as one number in their lexicographic order.
fn key(cell: [i64; 3]) -> u128 {
    // Far points share the outermost cells; distances decide, cells only propose.
    let part = |index: i64| (index.clamp(-(1 << 40), 1 << 40) + (1 << 41)) as u128;
    (part(cell[0]) << 84) | (part(cell[1]) << 42) | part(cell[2])
}

fn cell_of(key: u128) -> [i64; 3] {
    let part = |shift: u32| ((key >> shift) & ((1 << 42) - 1)) as i64 - (1 << 41);
    [part(84), part(42), part(0)]
}

impl Cells {
    /// Sorts points into cells; of points in one cell the sequence is that of their indices.
    pub(super) fn new(points: &[[f64; 3]], narrowness: &[f32], cell_m: f64) -> Self {
        let mut keyed: Vec<(u128, u32)> = points
            .iter()
            .zip(0..)
            .map(|(p, i)| (key(p.map(|value| (value / cell_m).floor() as i64)), i))
            .collect();
        keyed.sort();
        let (mut keys, mut starts) = (Vec::new(), Vec::new());
        for (place, (key, _)) in keyed.iter().enumerate() {
            if keys.last() != Some(key) {
                keys.push(*key);
                starts.push(place as u32);
            }
        }
        starts.push(points.len() as u32);
        let order: Vec<u32> = keyed.into_iter().map(|(_, index)| index).collect();
        let at = order.iter().map(|&i| points[i as usize]).collect();
        let narrowness = order.iter().map(|&i| narrowness[i as usize]).collect();
        let weight = vec![1.0; order.len()];
        Self { cell_m, keys, starts, order, at, narrowness, weight }
    }

    /// Gives every point a weight, by its index.
    pub(super) fn weigh(&mut self, weights: &[f32]) {
        self.weight.clear();
        self.weight.extend(self.order.iter().map(|&i| weights[i as usize]));
    }

    /// Number of occupied cells.
    pub(super) fn len(&self) -> usize {
        self.keys.len()
    }

    /// The places of a cell's points.
    pub(super) fn places(&self, cell: usize) -> Range<usize> {
        self.starts[cell] as usize..self.starts[cell + 1] as usize
    }

    /// The middle of a cell, m.
    pub(super) fn middle(&self, cell: usize) -> [f64; 3] {
        cell_of(self.keys[cell]).map(|index| (index as f64 + 0.5) * self.cell_m)
    }

    /// The first cell from `from` on whose key is not below `key`; looks near `from` first.
    fn seek(&self, from: usize, key: u128) -> usize {
        let (mut low, mut step) = (from, 1);
        while low + step < self.keys.len() && self.keys[low + step] < key {
            low += step;
            step *= 2;
        }
        let high = (low + step).min(self.keys.len());
        low + self.keys[low..high].partition_point(|k| *k < key)
    }
}

/// A box around targets and how far their neighbours may be from it, relative to a cell's middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Around {
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
    pub(super) reach_m: f32,
}

impl Around {
    /// Written out: this is asked once for every candidate.
    #[inline]
    fn holds(&self, x: f32, y: f32, z: f32) -> bool {
        let outside = |low: f32, at: f32, high: f32| {
            let (below, above) = (low - at, at - high);
            let most = if below > above { below } else { above };
            if most > 0.0 { most } else { 0.0 }
        };
        let dx = outside(self.low[0], x, self.high[0]);
        let dy = outside(self.low[1], y, self.high[1]);
        let dz = outside(self.low[2], z, self.high[2]);
        dx * dx + dy * dy + dz * dz <= self.reach_m * self.reach_m
    }
}

/// Gathers the neighbours of one cell after the other, in ascending sequence of cells.
#[derive(Debug)]
pub(super) struct Walk<'a> {
    source: &'a Cells,
    /// Where the row's search begins, by row.
    cursors: [usize; ROWS],
    blocks: Vec<Block>,
    len: usize,
}

impl<'a> Walk<'a> {
    /// Begins before the first cell.
    pub(super) fn new(source: &'a Cells) -> Self {
        Self { source, cursors: [0; ROWS], blocks: Vec::new(), len: 0 }
    }

    /// The points of the source near the cell `index` of `targets`, whose lattice is the same.
    pub(super) fn gather(&mut self, targets: &Cells, index: usize, around: &Around) -> &[Block] {
        let cell = cell_of(targets.keys[index]);
        let middle = targets.middle(index);
        self.len = 0;
        let mut row = 0;
        for dx in -RINGS..=RINGS {
            for dy in -RINGS..=RINGS {
                let [x, y] = [cell[0] + dx, cell[1] + dy];
                let first = self.source.seek(self.cursors[row], key([x, y, cell[2] - RINGS]));
                let last = key([x, y, cell[2] + RINGS]);
                self.cursors[row] = first;
                row += 1;
                let source = self.source;
                let cells = source.keys[first..].iter().take_while(|key| **key <= last).count();
                self.take(
                    source.starts[first] as usize..source.starts[first + cells] as usize,
                    middle,
                    around,
                );
            }
        }
        self.finish()
    }

    /// Adds those of a run of places that are near enough.
    fn take(&mut self, places: Range<usize>, middle: [f64; 3], around: &Around) {
        let blocks = (self.len + places.len()) / LANES + 1;
        if self.blocks.len() < blocks {
            self.blocks.resize(blocks, Block::EMPTY);
        }
        let source = self.source;
        for place in places {
            let [px, py, pz] = source.at[place];
            let x = (px - middle[0]) as f32;
            let y = (py - middle[1]) as f32;
            let z = (pz - middle[2]) as f32;
            if around.holds(x, y, z) {
                let (block, lane) = (&mut self.blocks[self.len / LANES], self.len % LANES);
                block.x[lane] = x;
                block.y[lane] = y;
                block.z[lane] = z;
                block.narrowness[lane] = source.narrowness[place];
                block.weight[lane] = source.weight[place];
                self.len += 1;
            }
        }
    }

    /// Fills the last block with neighbours of no weight.
    fn finish(&mut self) -> &[Block] {
        let used = self.len.div_ceil(LANES);
        if self.blocks.len() < used {
            self.blocks.resize(used, Block::EMPTY);
        }
        if !self.len.is_multiple_of(LANES) {
            let block = &mut self.blocks[used - 1];
            for lane in self.len % LANES..LANES {
                block.weight[lane] = 0.0;
                block.narrowness[lane] = 0.0;
                (block.x[lane], block.y[lane], block.z[lane]) = (0.0, 0.0, 0.0);
            }
        }
        &self.blocks[..used]
    }
}
