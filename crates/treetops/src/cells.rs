//! Points in sparse, world-fixed square cells, found by column and row.

use crate::input::Ranked;
use rayon::prelude::*;
use std::ops::Range;
use timberline_pointcloud::frame::{ticks_from_world, world_from_ticks};

/// Column and row of a cell: the cell's lower corner is this many edges from the world's origin.
pub(crate) type CellId = [i32; 2];

/// The points that take part, sorted by column, row and index.
#[derive(Debug)]
pub(crate) struct Cells {
    edge_ticks: i64,
    /// Occupied columns, ascending, and where their cells begin.
    columns: Vec<i32>,
    column_starts: Vec<u32>,
    /// Row of each cell, ascending within a column, and where its points begin.
    rows: Vec<i32>,
    starts: Vec<u32>,
    points: Vec<u32>,
}

impl Cells {
    /// Sorts the points that take part into cells of `edge_ticks` tenths of a millimetre.
    pub(crate) fn new(ranked: &Ranked<'_>, edge_ticks: i64) -> Self {
        let cloud = ranked.input.cloud;
        let mut keyed: Vec<(CellId, u32)> = (0..cloud.len() as u32)
            .into_par_iter()
            .filter(|&index| ranked.takes_part(index as usize))
            .map(|index| (cell_of(cloud.world(index as usize), edge_ticks), index))
            .collect();
        keyed.par_sort_unstable();
        let mut cells = Self {
            edge_ticks,
            columns: Vec::new(),
            column_starts: Vec::new(),
            rows: Vec::new(),
            starts: Vec::new(),
            points: Vec::with_capacity(keyed.len()),
        };
        let mut last = None;
        for (cell, index) in keyed {
            if last != Some(cell) {
                cells.open(cell, last);
                last = Some(cell);
            }
            cells.points.push(index);
        }
        cells.column_starts.push(cells.rows.len() as u32);
        cells.starts.push(cells.points.len() as u32);
        cells
    }

    fn open(&mut self, cell: CellId, last: Option<CellId>) {
        if last.map(|cell| cell[0]) != Some(cell[0]) {
            self.columns.push(cell[0]);
            self.column_starts.push(self.rows.len() as u32);
        }
        self.rows.push(cell[1]);
        self.starts.push(self.points.len() as u32);
    }

    /// Edge of the cells, metres.
    pub(crate) fn edge_m(&self) -> f64 {
        world_from_ticks(self.edge_ticks)
    }

    /// Number of occupied cells.
    pub(crate) fn len(&self) -> usize {
        self.rows.len()
    }

    /// The points of a cell, given by its place.
    pub(crate) fn points(&self, place: usize) -> &[u32] {
        &self.points[self.starts[place] as usize..self.starts[place + 1] as usize]
    }

    /// Row of a cell, given by its place.
    pub(crate) fn row(&self, place: usize) -> i32 {
        self.rows[place]
    }

    /// The cell that holds a world position.
    pub(crate) fn cell_at(&self, world_m: [f64; 3]) -> CellId {
        cell_of(world_m, self.edge_ticks)
    }

    /// Largest number of cells between two positions `reach_m` apart along an axis.
    pub(crate) fn span(&self, reach_m: f64) -> i32 {
        (ticks_from_world(reach_m) / self.edge_ticks + 1) as i32
    }

    /// Places of the occupied cells of one column, rows from `low` to `high`.
    pub(crate) fn run(&self, column: i32, low: i32, high: i32) -> Range<usize> {
        let Ok(at) = self.columns.binary_search(&column) else { return 0..0 };
        let begin = self.column_starts[at] as usize;
        let rows = &self.rows[begin..self.column_starts[at + 1] as usize];
        let first = rows.partition_point(|&row| row < low);
        let count = rows[first..].partition_point(|&row| row <= high);
        begin + first..begin + first + count
    }

    /// Places of the occupied cells within `span` columns and rows of a cell, nearest columns first.
    pub(crate) fn around(&self, [column, row]: CellId, span: i32) -> impl Iterator<Item = usize> {
        let offsets = (0..=2 * span).map(|k| if k % 2 == 0 { -(k / 2) } else { k / 2 + 1 });
        offsets.flat_map(move |offset| self.run(column + offset, row - span, row + span))
    }
}

fn cell_of(world_m: [f64; 3], edge_ticks: i64) -> CellId {
    let index = |value: f64| ticks_from_world(value).div_euclid(edge_ticks) as i32;
    [index(world_m[0]), index(world_m[1])]
}
