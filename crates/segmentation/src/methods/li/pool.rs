//! The points that have no tree yet, by cell.

use super::Ranked;
use timberline_pointcloud::Grid2;

/// Ranks by cell, ascending within a cell; ranks that have a tree are dropped.
#[derive(Debug)]
pub(super) struct Pool {
    inverse_cell: f64,
    cells: Vec<[i32; 2]>,
    ranks: Vec<Vec<u32>>,
}

impl Pool {
    /// All points, for circles of a radius.
    pub(super) fn new(ranked: &Ranked, radius_m: f64) -> Self {
        let cell_m = radius_m * 0.25;
        let mut pool = Self { inverse_cell: 1.0 / cell_m, cells: Vec::new(), ranks: Vec::new() };
        if let Ok(grid) = Grid2::new(&ranked.x, &ranked.y, cell_m) {
            for (cell, ranks) in grid.occupied() {
                pool.cells.push(cell);
                pool.ranks.push(ranks.to_vec());
            }
        }
        pool
    }

    /// Calls `visit` with the list of every cell that touches a square.
    pub(super) fn cells_around(
        &mut self,
        [x, y]: [f64; 2],
        reach_m: f64,
        mut visit: impl FnMut(&mut Vec<u32>),
    ) {
        let cell = |value: f64| (value * self.inverse_cell).floor() as i32;
        let (low, high) = (cell(y - reach_m), cell(y + reach_m));
        for column in cell(x - reach_m)..=cell(x + reach_m) {
            let first = self.cells.partition_point(|c| *c < [column, low]);
            let here = self.cells[first..].iter().take_while(|c| **c <= [column, high]).count();
            self.ranks[first..first + here].iter_mut().for_each(&mut visit);
        }
    }
}
