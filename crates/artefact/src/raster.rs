//! World-aligned rasters.

use serde::{Deserialize, Serialize};
use timberline_pointcloud::Window;

/// A raster whose cells lie on the lattice of whole multiples of the cell size in world coordinates.
///
/// Cell (column, row) covers `[column * cell_m, (column + 1) * cell_m)` to the east and the same of
/// the row to the north; its value belongs to the centre. Row 0 of `values` is the southernmost.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Raster {
    /// Edge of a cell in metres.
    pub cell_m: f64,
    /// World index of the westernmost column.
    pub column0: i64,
    /// World index of the southernmost row.
    pub row0: i64,
    /// Number of columns.
    pub columns: u32,
    /// Number of rows.
    pub rows: u32,
    /// Values, row by row from the south, west to east; NaN where there is none.
    pub values: Vec<f64>,
}

impl Raster {
    /// The raster of the cells whose centres lie in a half-open world rectangle, filled with NaN.
    #[must_use]
    pub fn covering(rect: &timberline_pointcloud::Rect, cell_m: f64) -> Self {
        let first = |low: f64| (low / cell_m - 0.5).ceil() as i64;
        let (column0, row0) = (first(rect.min[0]), first(rect.min[1]));
        let columns = (first(rect.max[0]) - column0).max(0) as u32;
        let rows = (first(rect.max[1]) - row0).max(0) as u32;
        let values = vec![f64::NAN; columns as usize * rows as usize];
        Self { cell_m, column0, row0, columns, rows, values }
    }

    /// The cells it covers.
    #[must_use]
    pub fn window(&self) -> Window {
        let Self { column0, row0, columns, rows, .. } = *self;
        Window { column0, row0, columns, rows }
    }

    /// World position of a cell's centre.
    #[must_use]
    pub fn centre(&self, column: u32, row: u32) -> [f64; 2] {
        [
            ((self.column0 + i64::from(column)) as f64 + 0.5) * self.cell_m,
            ((self.row0 + i64::from(row)) as f64 + 0.5) * self.cell_m,
        ]
    }

    /// Place of a cell in `values`.
    #[must_use]
    pub fn index(&self, column: u32, row: u32) -> usize {
        row as usize * self.columns as usize + column as usize
    }

    /// The place in `values` of the cell that holds a world position.
    #[must_use]
    pub fn cell_at(&self, world_x_m: f64, world_y_m: f64) -> Option<usize> {
        let column = (world_x_m / self.cell_m).floor() as i64 - self.column0;
        let row = (world_y_m / self.cell_m).floor() as i64 - self.row0;
        let inside = (0..i64::from(self.columns)).contains(&column)
            && (0..i64::from(self.rows)).contains(&row);
        inside.then(|| self.index(column as u32, row as u32))
    }

    /// Bilinear value between the four nearest centres; at the rim and beside gaps the value of the
    /// cell itself. `None` outside or where that is NaN.
    #[must_use]
    pub fn sample(&self, world_x_m: f64, world_y_m: f64) -> Option<f64> {
        let (u, v) = (world_x_m / self.cell_m - 0.5, world_y_m / self.cell_m - 0.5);
        let (column, row) = (u.floor() as i64 - self.column0, v.floor() as i64 - self.row0);
        let (fu, fv) = (u - u.floor(), v - v.floor());
        let inside = (0..i64::from(self.columns) - 1).contains(&column)
            && (0..i64::from(self.rows) - 1).contains(&row);
        if inside {
            let at =
                |dc: u32, dr: u32| self.values[self.index(column as u32 + dc, row as u32 + dr)];
            let south = at(0, 0) * (1.0 - fu) + at(1, 0) * fu;
            let north = at(0, 1) * (1.0 - fu) + at(1, 1) * fu;
            let value = south * (1.0 - fv) + north * fv;
            if !value.is_nan() {
                return Some(value);
            }
        }
        self.cell_at(world_x_m, world_y_m).map(|i| self.values[i]).filter(|value| !value.is_nan())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use timberline_pointcloud::Rect;

    #[test]
    fn adjacent_rectangles_share_no_cell() {
        let at = |low: f64| Rect { min: [low, 0.0], max: [low + 7.0, 4.0] };
        let (a, b) = (Raster::covering(&at(3.0), 0.5), Raster::covering(&at(10.0), 0.5));
        assert_eq!(a.column0 + i64::from(a.columns), b.column0);
        assert_eq!((a.columns, a.rows), (14, 8));
    }

    #[test]
    fn a_plane_is_sampled_exactly_inside() {
        let mut raster = Raster::covering(&Rect { min: [0.0, 0.0], max: [5.0, 5.0] }, 1.0);
        for row in 0..5 {
            for column in 0..5 {
                let [x, y] = raster.centre(column, row);
                let index = raster.index(column, row);
                raster.values[index] = 2.0 * x - y;
            }
        }
        assert!((raster.sample(2.25, 3.75).unwrap() - 0.75).abs() < 1e-12);
        assert_eq!(raster.sample(-1.0, 2.0), None);
    }
}
