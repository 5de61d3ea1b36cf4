//! Points sorted by the cells of a lattice, in blocks of neighbours ready to be summed over, and walks
//! along the sorted cells.

use super::kernel::{Block, LANES};
use std::ops::Range;

/// Rows of cells around a cell: a cell is as wide as the reach, so that the next ones suffice.
const ROWS: usize = 9;
/// A cell is cut into 2 to the power of this many slices along each axis, by which its points are sorted:
/// blocks are compact, and those out of reach are passed over whole.
const SLICE_BITS: u32 = 3;

/// Points in the sequence of their cells. Every cell begins a block of its own.
#[derive(Debug, Default)]
pub(super) struct Cells {
    cell_m: f64,
    /// Occupied cells, sorted.
    keys: Vec<u128>,
    /// `starts[i]..starts[i + 1]` are the places of cell `i`.
    starts: Vec<u32>,
    /// `block_starts[i]..block_starts[i + 1]` are the blocks of cell `i`.
    block_starts: Vec<u32>,
    /// The index of the point at each place.
    pub(super) order: Vec<u32>,
    /// Relative to the middle of their cell; what is left of a cell's last block has no weight.
    blocks: Vec<Block>,
    bounds: Vec<Bounds>,
}

/// The box of some points, m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    pub(super) const EMPTY: Self = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };

    pub(super) fn include(&mut self, at: [f32; 3]) {
        for axis in 0..3 {
            self.low[axis] = self.low[axis].min(at[axis]);
            self.high[axis] = self.high[axis].max(at[axis]);
        }
    }
}

/// The three indices of a cell as one number in their lexicographic order.
fn key(cell: [i64; 3]) -> u128 {
    // Far points share the outermost cells; distances decide, cells only propose.
    let part = |index: i64| (index.clamp(-(1 << 37), 1 << 37) + (1 << 38)) as u128;
    (part(cell[0]) << 78) | (part(cell[1]) << 39) | part(cell[2])
}

fn cell_of(key: u128) -> [i64; 3] {
    let part = |shift: u32| ((key >> shift) & ((1 << 39) - 1)) as i64 - (1 << 38);
    [part(78), part(39), part(0)]
}

/// The cell of a point, and within it the slice along each axis, interleaved (Morton 1966).
fn place_key(point: [f64; 3], cell_m: f64) -> u128 {
    let slices = f64::from(1u32 << SLICE_BITS);
    let (mut cell, mut slice) = ([0; 3], [0; 3]);
    for axis in 0..3 {
        let along = point[axis] / cell_m;
        let first = along.floor();
        cell[axis] = first as i64;
        slice[axis] = ((along - first) * slices) as u128;
    }
    let mut within = 0;
    for bit in (0..SLICE_BITS).rev() {
        for part in slice {
            within = (within << 1) | ((part >> bit) & 1);
        }
    }
    (key(cell) << (3 * SLICE_BITS)) | within
}

impl Cells {
    /// Sorts points into cells; of points in one slice of a cell the sequence is that of their indices.
    pub(super) fn new(points: &[[f64; 3]], narrowness: &[f32], cell_m: f64) -> Self {
        let mut keyed: Vec<(u128, u32)> =
            points.iter().zip(0..).map(|(p, i)| (place_key(*p, cell_m), i)).collect();
        keyed.sort_unstable();
        let mut cells = Self { cell_m, ..Self::default() };
        cells.order = keyed.iter().map(|(_, index)| *index).collect();
        let mut start = 0;
        for cell in keyed.chunk_by(|a, b| a.0 >> (3 * SLICE_BITS) == b.0 >> (3 * SLICE_BITS)) {
            cells.starts.push(start);
            cells.push(cell, points, narrowness);
            start += cell.len() as u32;
        }
        cells.starts.push(points.len() as u32);
        cells.block_starts.push(cells.blocks.len() as u32);
        cells
    }

    /// Adds the blocks of the next cell.
    fn push(&mut self, members: &[(u128, u32)], points: &[[f64; 3]], narrowness: &[f32]) {
        self.keys.push(members[0].0 >> (3 * SLICE_BITS));
        self.block_starts.push(self.blocks.len() as u32);
        let middle = self.middle(self.keys.len() - 1);
        for eight in members.chunks(LANES) {
            let (mut block, mut bounds) = (Block::EMPTY, Bounds::EMPTY);
            for (lane, (_, index)) in eight.iter().enumerate() {
                let at = relative(points[*index as usize], middle);
                (block.x[lane], block.y[lane], block.z[lane]) = (at[0], at[1], at[2]);
                block.narrowness[lane] = narrowness[*index as usize];
                block.weight[lane] = 1.0;
                bounds.include(at);
            }
            self.blocks.push(block);
            self.bounds.push(bounds);
        }
    }

    /// Gives every point a weight, by its index.
    pub(super) fn weigh(&mut self, weights: &[f32]) {
        for cell in 0..self.len() {
            let own = self.starts[cell] as usize..self.starts[cell + 1] as usize;
            let blocks = self.block_starts[cell] as usize..self.block_starts[cell + 1] as usize;
            for (block, places) in self.blocks[blocks].iter_mut().zip(self.order[own].chunks(LANES))
            {
                let lanes = block.weight.iter_mut().zip(places);
                lanes.for_each(|(weight, index)| *weight = weights[*index as usize]);
            }
        }
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

/// Offset of a point from the middle of a cell, m.
pub(super) fn relative(point: [f64; 3], middle: [f64; 3]) -> [f32; 3] {
    [(point[0] - middle[0]) as f32, (point[1] - middle[1]) as f32, (point[2] - middle[2]) as f32]
}

/// A box around targets and how far their neighbours may be from it, relative to a cell's middle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Around {
    pub(super) targets: Bounds,
    pub(super) reach_m: f32,
}

impl Around {
    /// Whether a box of neighbours, moved by `shift`, comes near enough.
    #[inline(always)]
    fn touches(&self, bounds: &Bounds, shift: [f32; 3]) -> bool {
        let mut squared = 0.0;
        for axis in 0..3 {
            let below = self.targets.low[axis] - (bounds.high[axis] + shift[axis]);
            let above = (bounds.low[axis] + shift[axis]) - self.targets.high[axis];
            let most = if below > above { below } else { above };
            let gap = if most > 0.0 { most } else { 0.0 };
            squared += gap * gap;
        }
        squared <= self.reach_m * self.reach_m
    }
}

/// Gathers the neighbours of one cell after the other, in ascending sequence of cells.
#[derive(Debug)]
pub(super) struct Walk<'a> {
    source: &'a Cells,
    /// Where the row's search begins, by row.
    cursors: [usize; ROWS],
    /// The blocks of the cells around, and where these lie from the cell in the middle, m.
    around: Vec<(Range<u32>, [f32; 3])>,
    blocks: Vec<Block>,
}

impl<'a> Walk<'a> {
    /// Begins before the first cell.
    pub(super) fn new(source: &'a Cells) -> Self {
        Self { source, cursors: [0; ROWS], around: Vec::new(), blocks: Vec::new() }
    }

    /// Goes to the cell `index` of `targets`, whose lattice is the same.
    pub(super) fn enter(&mut self, targets: &Cells, index: usize) {
        let (source, cell) = (self.source, cell_of(targets.keys[index]));
        self.around.clear();
        for (row, cursor) in self.cursors.iter_mut().enumerate() {
            let [x, y] = [cell[0] + row as i64 / 3 - 1, cell[1] + row as i64 % 3 - 1];
            let first = source.seek(*cursor, key([x, y, cell[2] - 1]));
            let last = key([x, y, cell[2] + 1]);
            *cursor = first;
            for near in first..source.len() {
                if source.keys[near] > last {
                    break;
                }
                let there = cell_of(source.keys[near]);
                let shift = [0, 1, 2]
                    .map(|axis| ((there[axis] - cell[axis]) as f64 * source.cell_m) as f32);
                self.around.push((source.block_starts[near]..source.block_starts[near + 1], shift));
            }
        }
    }

    /// The blocks of the source that may hold neighbours, relative to the middle of the cell entered.
    #[inline(always)]
    pub(super) fn gather(&mut self, around: &Around) -> &[Block] {
        self.blocks.clear();
        for (range, shift) in &self.around {
            let range = range.start as usize..range.end as usize;
            let bounds = &self.source.bounds[range.clone()];
            for (block, bounds) in self.source.blocks[range].iter().zip(bounds) {
                if around.touches(bounds, *shift) {
                    self.blocks.push(block.moved(*shift));
                }
            }
        }
        &self.blocks
    }
}
