//! Sparse grids of sorted cells for queries within a fixed radius.
//!
//! Memory is proportional to the number of points, never to the area. Positions are taken in any
//! one frame; which points a query finds does not depend on the frame, the sequence in which it
//! finds them may: sort, or do only what is independent of the sequence.

use crate::Error;

/// A grid over positions of `D` dimensions: points sorted by cell, and the sorted list of cells.
#[derive(Debug, Clone)]
struct Cells<const D: usize> {
    inverse_cell: f64,
    /// The occupied cells, sorted, last axis fastest.
    cells: Vec<[i32; D]>,
    /// `starts[i]..starts[i + 1]` are the places in `order` of cell `i`.
    starts: Vec<u32>,
    /// Point indices sorted by cell, then ascending.
    order: Vec<u32>,
}

impl<const D: usize> Cells<D> {
    fn new(len: usize, position: impl Fn(usize) -> [f64; D], cell_m: f64) -> Result<Self, Error> {
        if !(cell_m.is_finite() && cell_m > 0.0) {
            return Err(Error::CellSize(cell_m));
        }
        let inverse_cell = 1.0 / cell_m;
        let cell_of = |p: [f64; D]| p.map(|value| (value * inverse_cell).floor() as i32);
        let mut keyed: Vec<([i32; D], u32)> =
            (0..len).map(|i| (cell_of(position(i)), i as u32)).collect();
        keyed.sort_unstable();
        let (mut cells, mut starts) = (Vec::new(), Vec::new());
        for (place, (cell, _)) in keyed.iter().enumerate() {
            if cells.last() != Some(cell) {
                cells.push(*cell);
                starts.push(place as u32);
            }
        }
        starts.push(len as u32);
        let order = keyed.into_iter().map(|(_, index)| index).collect();
        Ok(Self { inverse_cell, cells, starts, order })
    }

    fn cell(&self, value: f64) -> i32 {
        (value * self.inverse_cell).floor() as i32
    }

    /// Calls `visit` with the indices of a run of cells from `low` to `high` (same but last axis).
    fn row(&self, low: [i32; D], high: [i32; D], mut visit: impl FnMut(usize)) {
        let first = self.cells.partition_point(|cell| *cell < low);
        let last = first + self.cells[first..].partition_point(|cell| *cell <= high);
        if first < last {
            let places = self.starts[first] as usize..self.starts[last] as usize;
            self.order[places].iter().for_each(|&index| visit(index as usize));
        }
    }
}

/// A grid over points in the plane.
#[derive(Debug, Clone)]
pub struct Grid2 {
    cells: Cells<2>,
}

impl Grid2 {
    /// Sorts the points into cells. A cell near the usual query radius is fastest.
    ///
    /// # Errors
    /// [`Error::CellSize`] unless the cell is positive and finite.
    pub fn new(x: &[f64], y: &[f64], cell_m: f64) -> Result<Self, Error> {
        Ok(Self { cells: Cells::new(x.len().min(y.len()), |i| [x[i], y[i]], cell_m)? })
    }

    /// Calls `visit` for every point in the cells that touch the square of half-width `reach_m`
    /// around a position: a superset of the points within that square or circle.
    pub fn candidates(&self, x: f64, y: f64, reach_m: f64, mut visit: impl FnMut(usize)) {
        let cells = &self.cells;
        let (low, high) = (cells.cell(y - reach_m), cells.cell(y + reach_m));
        for column in cells.cell(x - reach_m)..=cells.cell(x + reach_m) {
            cells.row([column, low], [column, high], &mut visit);
        }
    }

    /// The occupied cells with the points in each (ascending), in sorted order of cells
    /// (column, row); a cell's corner is its index times the cell size.
    pub fn occupied(&self) -> impl Iterator<Item = ([i32; 2], &[u32])> {
        self.cells.cells.iter().enumerate().map(|(i, cell)| {
            let places = self.cells.starts[i] as usize..self.cells.starts[i + 1] as usize;
            (*cell, &self.cells.order[places])
        })
    }
}

/// A grid over points in space.
#[derive(Debug, Clone)]
pub struct Grid3 {
    cells: Cells<3>,
}

impl Grid3 {
    /// Sorts the points into cells. A cell near the usual query radius is fastest.
    ///
    /// # Errors
    /// [`Error::CellSize`] unless the cell is positive and finite.
    pub fn new(x: &[f64], y: &[f64], z: &[f64], cell_m: f64) -> Result<Self, Error> {
        let len = x.len().min(y.len()).min(z.len());
        Ok(Self { cells: Cells::new(len, |i| [x[i], y[i], z[i]], cell_m)? })
    }

    /// Calls `visit` for every point in the cells that touch the cube of half-width `reach_m`
    /// around a position: a superset of the points within that cube or ball.
    pub fn candidates(&self, at: [f64; 3], reach_m: f64, mut visit: impl FnMut(usize)) {
        let cells = &self.cells;
        let range = |axis: usize| cells.cell(at[axis] - reach_m)..=cells.cell(at[axis] + reach_m);
        let (low, high) = (*range(2).start(), *range(2).end());
        for ix in range(0) {
            for iy in range(1) {
                cells.row([ix, iy, low], [ix, iy, high], &mut visit);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn nothing_within_the_radius_is_missed(
            points in prop::collection::vec((-20f64..20., -20f64..20., -20f64..20.), 0..80),
            radius in 0.1f64..9., cell in 0.2f64..7.,
        ) {
            let x: Vec<f64> = points.iter().map(|p| p.0).collect();
            let y: Vec<f64> = points.iter().map(|p| p.1).collect();
            let z: Vec<f64> = points.iter().map(|p| p.2).collect();
            let flat = |i: &usize| x[*i] * x[*i] + y[*i] * y[*i] <= radius * radius;
            let full = |i: &usize| x[*i] * x[*i] + y[*i] * y[*i] + z[*i] * z[*i] <= radius * radius;
            let (mut found2, mut found3) = (Vec::new(), Vec::new());
            Grid2::new(&x, &y, cell).unwrap().candidates(0., 0., radius, |i| found2.push(i));
            Grid3::new(&x, &y, &z, cell).unwrap().candidates([0.; 3], radius, |i| found3.push(i));
            found2.retain(flat);
            found3.retain(full);
            found2.sort_unstable();
            found3.sort_unstable();
            prop_assert_eq!(found2, (0..x.len()).filter(flat).collect::<Vec<_>>());
            prop_assert_eq!(found3, (0..x.len()).filter(full).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_cell_of_no_size_is_refused() {
        assert_eq!(Grid2::new(&[], &[], 0.0).unwrap_err(), Error::CellSize(0.0));
    }
}
